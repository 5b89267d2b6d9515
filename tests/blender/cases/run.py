"""Runs the case that $RCS_CASE names, with stage.py beside it: Blender looks for modules elsewhere."""

import faulthandler
import os
import pathlib
import runpy
import sys

faulthandler.enable()
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
runpy.run_path(os.environ["RCS_CASE"])
