"""What the files that a scene names really hold, read before anything is planned or computed: once in a process."""
