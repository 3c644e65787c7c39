"""How large a mesh will be, and how much memory its matrices take, before either is made."""
