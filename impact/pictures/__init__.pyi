# ruff: noqa: I001 (one import a module)
from impact.pictures import drawing as drawing, lip_plots as lip_plots, plots as plots
