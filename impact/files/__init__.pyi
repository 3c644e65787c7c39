# ruff: noqa: I001 (one import a module)
from impact.files import csv_table as csv_table, safe_files as safe_files
