"""Panda3D's scene graphs, drawn by this package: pip install 'firefly_sample[panda3d]'.

`from_panda3d` converts a graph as it is at one moment, `FireflyView` draws a
running ShowBase. docs/panda3d.md says what is different.
"""

from firefly_sample.interop.panda3d.bridge import from_panda3d as from_panda3d
from firefly_sample.interop.panda3d.mirror import GraphMirror as GraphMirror
from firefly_sample.interop.panda3d.view import FireflyView as FireflyView
