"""What is asked of bodies that strike each other: scenes, plans, runs, trades."""
