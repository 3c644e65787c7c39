"""What the program answers today, frozen: numbers of scenes, and the help of its verbs."""
