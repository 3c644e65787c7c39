"""What a run answers, in words: go, no-go or undecided and why, comparisons, what was left out, who checked it."""
