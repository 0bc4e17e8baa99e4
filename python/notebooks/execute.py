"""Executes the notebooks of this folder: `python execute.py [FOLDER] [NAME …]`. The results are written to FOLDER.

An error of a cell ends the program. A notebook whose packages are missing is skipped, with a message.
"""

import importlib.util
import pathlib
import sys
import time

import nbformat
from nbclient import NotebookClient

HERE = pathlib.Path(__file__).parent
NEEDS = {"03-own-function-with-jax": ["jax"], "04-foreign-simulator": ["mujoco"], "05-study-with-dask": ["dask", "distributed"]}


def main(folder=None, *names):
    for path in sorted(HERE.glob("*.ipynb")):
        if names and path.stem not in names:
            continue
        missing = [name for name in NEEDS.get(path.stem, []) if importlib.util.find_spec(name) is None]
        if missing:
            print(f"{path.stem}: skipped, needs {', '.join(missing)}")
            continue
        begun = time.perf_counter()
        notebook = nbformat.read(path, as_version=4)
        # The folder of the notebook, so that it finds the modules and models beside it.
        NotebookClient(notebook, timeout=300, kernel_name="python3", resources={"metadata": {"path": str(HERE)}}).execute()
        if folder is not None:
            pathlib.Path(folder).mkdir(parents=True, exist_ok=True)
            nbformat.write(notebook, pathlib.Path(folder) / path.name)
        print(f"{path.stem}: {time.perf_counter() - begun:.1f} s")


if __name__ == "__main__":
    main(*sys.argv[1:])
