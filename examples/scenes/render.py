"""Renders frames of a result folder side by side: render.py RESULT_DIR OUT.png FRAME [FRAME ...]

Needs pyvista. Colour is von Mises stress; thin lines are cells; bodies are drawn where they are, not at rest.
"""
import pathlib
import sys

import numpy as np
import pyvista as pv


def main(folder, out, frames):
    pv.OFF_SCREEN = True
    reader = pv.get_reader(next(pathlib.Path(folder).glob("*.pvd")))
    times = reader.time_values
    plot = pv.Plotter(off_screen=True, shape=(1, len(frames)), window_size=(560 * len(frames), 520), border=False)
    for k, frame in enumerate(frames):
        reader.set_active_time_point(min(frame, len(times) - 1))
        grid = reader.read()[0]
        moved = grid.copy()
        moved.points = np.asarray(grid.points) + grid.point_data["displacement"]
        plot.subplot(0, k)
        limit = float(np.percentile(moved.cell_data["von_mises"], 97))
        plot.add_mesh(moved, scalars="von_mises", clim=(0, limit), cmap="viridis", show_edges=True, line_width=0.5,
                      show_scalar_bar=False)
        plot.add_text(f"t = {times[min(frame, len(times) - 1)]:.2f} s, von Mises stress 0 to {limit:.0f} Pa", font_size=9)
        plot.camera_position = "xz"
        plot.camera.azimuth, plot.camera.elevation = 15, 35
        plot.reset_camera()
        plot.camera.zoom(1.25)
    plot.set_background("white")
    plot.screenshot(out)


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2], [int(f) for f in sys.argv[3:]])
