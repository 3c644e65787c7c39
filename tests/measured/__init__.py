"""Numbers that others measured: NAME.toml holds them, NAME.py predicts them, `seatfem verify --measured` compares."""
