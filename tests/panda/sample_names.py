"""The methods of NodePath that Panda3D's sample programs call, program by program.

Read from 52 programs in the folder ``samples`` of the repository panda3d/panda3d, on nodes of the scene, the
camera and the text alike; ``setPos`` counts as ``set_pos``. What belongs to Actor, to intervals or to a node
is left out.
"""

from __future__ import annotations

from collections import Counter

_BULLET = (
    "attach_new_node clear_light hide is_hidden look_at node remove_node set_collide_mask "
    "set_light set_pos show"
)

CALLED = {
    "asteroids": (
        "get_pos get_python_tag get_r get_scale get_texture hide remove_node reparent_to set_bin "
        "set_depth_test set_pos set_python_tag set_r set_scale set_texture set_transparency set_x set_z"
        " show"
    ),
    "ball-in-maze": (
        "attach_new_node find get_pos get_quat get_x get_y get_z node reparent_to set_light "
        "set_material set_p set_pos set_pos_hpr set_quat set_r set_x set_y set_z"
    ),
    "boxing-robots": "attach_new_node reparent_to set_color set_light set_pos_hpr set_pos_hpr_scale",
    "bullet-samples/02_shapes": _BULLET,
    "bullet-samples/03_heightfield": f"{_BULLET} clear_model_nodes reparent_to set_sz",
    "bullet-samples/04_filtering": f"{_BULLET} reparent_to",
    "bullet-samples/06_filtering_python": (
        "attach_new_node clear_light hide is_hidden look_at node remove_node set_light set_pos "
        "set_python_tag show"
    ),
    "bullet-samples/07_raycast": f"{_BULLET} reparent_to",
    "bullet-samples/09_ccd": f"{_BULLET} clear_model_nodes get_relative_point reparent_to",
    "bullet-samples/16_ghost_local": f"{_BULLET} clear_model_nodes reparent_to",
    "bullet-samples/17_character": f"{_BULLET} reparent_to set_h set_scale",
    "bullet-samples/18_vehicle": f"{_BULLET} reparent_to",
    "bullet-samples/19_ball_in_maze": (
        "attach_new_node clear_model_nodes get_x get_y get_z hide is_hidden node reparent_to set_hpr "
        "set_light set_material set_pos set_pos_hpr set_x set_y set_z show"
    ),
    "bullet-samples/20_bowl_and_eggs": f"{_BULLET} find_all_matches reparent_to set_pos_hpr set_scale",
    "bullet-samples/23_softbody_pressure": f"{_BULLET} reparent_to set_scale",
    "bullet-samples/26_softbody_aero": f"{_BULLET} set_hpr set_texture",
    "bump-mapping": (
        "attach_new_node get_h get_mat get_pos get_x get_y get_z hpr_interval reparent_to set_h set_hpr"
        " set_light set_pos set_shader_auto set_shader_off set_x set_y set_z"
    ),
    "carousel": (
        "attach_new_node hpr_interval reparent_to set_h set_light set_light_off set_pos_hpr set_scale "
        "set_texture set_y set_z"
    ),
    "cartoon-shader/advanced": (
        "attach_new_node get_state hpr_interval node reparent_to set_color set_pos set_shader "
        "set_shader_input set_transparency"
    ),
    "cartoon-shader/basic": (
        "attach_new_node get_state hpr_interval node reparent_to set_attrib set_light set_pos set_shader_auto"
    ),
    "chessboard": (
        "attach_new_node find get_relative_point get_relative_vector node reparent_to set_color "
        "set_light set_pos set_pos_hpr"
    ),
    "culling/occluder_culling": (
        "copy_to find_all_matches hide_bounds node reparent_to set_color_scale set_color_scale_off "
        "set_hpr set_occluder set_pos set_scale set_tex_gen set_tex_projector set_tex_scale set_texture"
        " set_transparency show_bounds"
    ),
    "culling/portal_culling": (
        "attach_new_node find_all_matches get_name get_pos hide hide_bounds node remove_node "
        "reparent_to set_collide_mask set_color_scale set_color_scale_off set_hpr set_pos set_scale "
        "set_tex_gen set_tex_projector set_tex_scale set_texture set_transparency show show_bounds"
    ),
    "disco-lights": (
        "attach_new_node clear_light clear_shader has_light hpr_interval node reparent_to set_color "
        "set_light set_pos set_pos_hpr set_scale set_shader_auto set_z"
    ),
    "distortion": (
        "hide hpr_interval node reparent_to set_pos set_pos_hpr set_scale set_shader set_shader_input "
        "set_texture show"
    ),
    "fireflies": (
        "attach_new_node get_state hide instance_to node pos_interval remove_node reparent_to "
        "scale_interval set_attrib set_color set_hpr set_pos set_scale set_shader set_shader_input "
        "set_state set_texture"
    ),
    "fractal-plants": (
        "attach_new_node find_all_matches get_pos look_at reparent_to set_light set_pos set_texture "
        "set_transform"
    ),
    "gamepad/gamepad": "hide is_hidden reparent_to set_h set_p set_x set_y show",
    "gamepad/mappingGUI": "find reparent_to set_transparency",
    "gamepad/steeringWheel": "hide is_hidden reparent_to set_h set_y set_z show",
    "glow-filter/advanced": (
        "attach_new_node get_state hpr_interval node reparent_to set_attrib set_hpr set_light set_pos "
        "set_shader"
    ),
    "glow-filter/basic": "attach_new_node hpr_interval reparent_to set_hpr set_light set_pos",
    "infinite-tunnel": "clear_fog get_fog reparent_to set_fog set_pos set_pos_hpr set_scale set_z",
    "looking-and-gripping": (
        "attach_new_node hide reparent_to set_h set_hpr set_light set_p set_pos set_scale show"
    ),
    "media-player": "reparent_to set_texture",
    "motion-trails": (
        "attach_new_node hide node reparent_to set_color set_depth_test set_depth_write set_hpr "
        "set_light set_pos set_r set_scale set_transparency show"
    ),
    "motion-trails/framebuffer-feedback": (
        "attach_new_node hide node reparent_to set_color set_depth_test set_depth_write set_hpr "
        "set_light set_pos set_r set_scale set_transparency show"
    ),
    "motion-trails/fireball": (
        "attach_new_node copy_to get_pos hpr_interval look_at reparent_to set_color set_pos set_r "
        "set_texture set_x set_z"
    ),
    "mouse-modes": "look_at reparent_to set_h set_p set_pos",
    "music-box": (
        "attach_new_node find hpr_interval reparent_to set_hpr set_light set_pos set_shader_auto "
        "wrt_reparent_to"
    ),
    "particles/steam_example": "attach_new_node reparent_to set_light set_pos",
    "procedural-cube": (
        "attach_new_node has_texture hpr_interval look_at set_light set_light_off set_pos set_texture "
        "set_texture_off set_two_sided"
    ),
    "render-to-texture": (
        "attach_new_node find get_x get_y hpr_interval reparent_to set_hpr set_light set_pos "
        "set_texture set_x set_y"
    ),
    "roaming-ralph": (
        "attach_new_node find get_h get_pos get_x get_y get_z look_at reparent_to set_h set_light "
        "set_pos set_scale set_x set_y set_z"
    ),
    "rocket-console": (
        "attach_new_node find get_mat reparent_to set_hpr set_light set_pos set_scale set_shader_auto "
        "set_texture"
    ),
    "shader-terrain": (
        "attach_new_node reparent_to set_pos set_scale set_shader set_shader_input set_texture"
    ),
    "shadows/advanced": (
        "attach_new_node flatten_strong get_state hpr_interval look_at node reparent_to set_p set_pos "
        "set_shader set_shader_input set_texture"
    ),
    "shadows/basic": (
        "attach_new_node flatten_strong hpr_interval look_at node reparent_to set_light set_p set_pos "
        "set_scale set_shader_auto set_shader_input set_texture"
    ),
    "shadows/noshader": (
        "attach_new_node flatten_strong hpr_interval look_at node project_texture reparent_to set_light"
        " set_p set_pos set_texture set_two_sided"
    ),
    "solar-system": "attach_new_node hpr_interval reparent_to set_hpr set_pos set_scale set_texture",
    "texture-swapping": (
        "node reparent_to set_pos set_pos_hpr set_pos_hpr_scale set_texture set_transparency"
    ),
    "texture-swapping/elevator": "get_z reparent_to set_pos set_pos_hpr set_texture set_z",
}

COUNTS = Counter(name for names in CALLED.values() for name in names.split())
"""How many of the programs call each name."""
