# ruff: noqa: I001 (one import a module)
from seatfem.faces.report import asked as asked, figures as figures, fragments as fragments, page as page
