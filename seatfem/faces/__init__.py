"""Everything with which a user interacts: the command line, tables, sentences and progress bars."""
