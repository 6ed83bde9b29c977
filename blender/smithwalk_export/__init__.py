"""The add-on: File > Export > smithwalk (.yaml)."""

import os

import bpy
from bpy.props import StringProperty
from bpy_extras.io_utils import ExportHelper

from .scene import ExportError, export

bl_info = {
    "name": "smithwalk scene",
    "description": "Export to the smithwalk path tracer: scene.yaml, OBJ meshes, images",
    "author": "the smithwalk authors",
    "version": (0, 1, 0),
    "blender": (3, 4, 0),
    "location": "File > Export > smithwalk",
    "category": "Import-Export",
}


class EXPORT_SCENE_OT_smithwalk(bpy.types.Operator, ExportHelper):
    """Write the scene as it would be rendered to a folder: scene.yaml and its files"""

    bl_idname = "export_scene.smithwalk"
    bl_label = "Export smithwalk scene"
    filename_ext = ".yaml"
    filter_glob: StringProperty(default="*.yaml", options={"HIDDEN"})

    def execute(self, context):
        """Export into the folder of the chosen file."""
        try:
            log = export(context.scene, os.path.dirname(self.filepath))
        except (ExportError, OSError) as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        self.report({"WARNING"} if log.warnings else {"INFO"}, log.summary())
        return {"FINISHED"}


def _menu(self, _context):
    self.layout.operator(EXPORT_SCENE_OT_smithwalk.bl_idname, text="smithwalk (.yaml)")


def register():
    """Called by Blender when the add-on is enabled."""
    bpy.utils.register_class(EXPORT_SCENE_OT_smithwalk)
    bpy.types.TOPBAR_MT_file_export.append(_menu)


def unregister():
    """Called by Blender when the add-on is disabled."""
    bpy.types.TOPBAR_MT_file_export.remove(_menu)
    bpy.utils.unregister_class(EXPORT_SCENE_OT_smithwalk)
