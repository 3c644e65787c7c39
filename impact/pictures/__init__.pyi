# ruff: noqa: I001 (one import a module)
from impact.pictures import drawing as drawing, greens_plots as greens_plots, lip_plots as lip_plots, plots as plots
