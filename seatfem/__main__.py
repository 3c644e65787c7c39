"""`python -m seatfem` is the program `seatfem`."""

from seatfem.faces.cli import main

if __name__ == "__main__":
    main()
