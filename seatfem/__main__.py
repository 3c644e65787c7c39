"""`python -m seatfem` is the program `seatfem`."""

from seatfem.cli import main

if __name__ == "__main__":
    main()
