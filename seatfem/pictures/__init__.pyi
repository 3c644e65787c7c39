# ruff: noqa: I001 (one import a module)
from seatfem.pictures import (
    cell_grid as cell_grid,
    faces_picture as faces_picture,
    fit_plots as fit_plots,
    frames as frames,
    layout as layout,
    moving as moving,
    picture_worker as picture_worker,
    plots as plots,
    rendering as rendering,
    scene_drawing as scene_drawing,
    stress_plot as stress_plot,
)
