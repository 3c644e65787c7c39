"""This room states in words what a run answers: go, no-go or undecided, comparisons, what was left out."""
