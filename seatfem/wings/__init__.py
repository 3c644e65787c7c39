"""Wings: parts of the program that no other part imports. Each file registers what it adds, and may be removed."""
