# ruff: noqa: I001 (one import a module)
from seatfem.faces.report import asked as asked, figures as figures, page as page, sections as sections
