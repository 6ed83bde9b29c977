"""The add-on: the render engine "smithwalk", and File > Export > smithwalk (.yaml)."""

import os

import bpy
from bpy.props import BoolProperty, StringProperty
from bpy_extras.io_utils import ExportHelper

bl_info = {
    "name": "smithwalk",
    "description": "Render with the smithwalk path tracer, or export to it: scene.yaml, OBJ meshes, images",
    "author": "the smithwalk authors",
    "version": (0, 2, 0),
    "blender": (3, 4, 0),
    "location": "Properties > Render > Render Engine; File > Export > smithwalk",
    "category": "Render",
}


class EXPORT_SCENE_OT_smithwalk(bpy.types.Operator, ExportHelper):
    """Write the scene as it would be rendered to a folder of the chosen name: scene.yaml and its files"""

    bl_idname = "export_scene.smithwalk"
    bl_label = "Export smithwalk scene"
    filename_ext = ".yaml"
    filter_glob: StringProperty(default="*.yaml", options={"HIDDEN"})
    bake: BoolProperty(name="Bake", default=True,
                       description="Let Cycles evaluate what the scene format has no word for")

    def execute(self, context):
        """Export into a folder named like the chosen file."""
        from .scene import BAKE, NO_BAKE, ExportError, export
        folder = os.path.splitext(self.filepath)[0]
        manager = context.window_manager
        manager.progress_begin(0, 100)
        try:
            log = export(context.scene, folder, bake=BAKE if self.bake else NO_BAKE,
                         progress=lambda _, share: manager.progress_update(int(100 * share)))
        except (ExportError, OSError, RuntimeError) as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        finally:
            manager.progress_end()
        self.report({"WARNING"} if log.strict_failure else {"INFO"}, log.summary())
        return {"FINISHED"}


def _menu(self, _context):
    self.layout.operator(EXPORT_SCENE_OT_smithwalk.bl_idname, text="smithwalk (.yaml)")


def register():
    """Called by Blender when the add-on is enabled."""
    from . import engine
    bpy.utils.register_class(EXPORT_SCENE_OT_smithwalk)
    bpy.types.TOPBAR_MT_file_export.append(_menu)
    engine.register()


def unregister():
    """Called by Blender when the add-on is disabled."""
    from . import engine
    engine.unregister()
    bpy.types.TOPBAR_MT_file_export.remove(_menu)
    bpy.utils.unregister_class(EXPORT_SCENE_OT_smithwalk)
