# ruff: noqa: I001 (one import a module)
from impact.files import csv_table as csv_table, hdf5_structure as hdf5_structure, safe_files as safe_files
