"""What a user meets: the command line, tables, sentences and progress bars."""
