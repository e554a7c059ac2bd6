#include "core/color/color_config.h"

namespace strobe {

const char* const kBuiltinColorConfig = R"(ocio_profile_version: 2

description: strobe's built-in config. Scenes are linear Rec. 709; the view ACES is the ACES 1.0 tone curve.
strictparsing: true
luma: [0.2126, 0.7152, 0.0722]

roles:
  aces_interchange: ACES2065-1
  cie_xyz_d65_interchange: CIE XYZ-D65
  color_picking: srgb_texture
  color_timing: ACEScct
  compositing_log: ACEScct
  data: raw
  default: lin_rec709
  matte_paint: srgb_texture
  reference: ACES2065-1
  rendering: lin_rec709
  scene_linear: lin_rec709
  texture_paint: srgb_texture

file_rules:
  - !<Rule> {name: Default, colorspace: default}

displays:
  sRGB:
    - !<View> {name: Standard, view_transform: Standard, display_colorspace: sRGB Display}
    - !<View> {name: ACES, view_transform: ACES, display_colorspace: sRGB Display}
    - !<View> {name: Raw, colorspace: raw}
  Rec.1886 Rec.709:
    - !<View> {name: Standard, view_transform: Standard, display_colorspace: Rec.1886 Rec.709 Display}
    - !<View> {name: ACES, view_transform: ACES, display_colorspace: Rec.1886 Rec.709 Display}
    - !<View> {name: Raw, colorspace: raw}
  P3-D65:
    - !<View> {name: Standard, view_transform: Standard, display_colorspace: P3-D65 Display}
    - !<View> {name: ACES, view_transform: ACES, display_colorspace: P3-D65 Display}
    - !<View> {name: Raw, colorspace: raw}

active_displays: [sRGB, Rec.1886 Rec.709, P3-D65]
active_views: [Standard, ACES, Raw]

default_view_transform: Standard

view_transforms:
  - !<ViewTransform>
    name: Standard
    description: No tone mapping; colors beyond the display's range are clipped
    from_scene_reference: !<BuiltinTransform> {style: UTILITY - ACES-AP0_to_CIE-XYZ-D65_BFD}

  - !<ViewTransform>
    name: ACES
    description: The ACES 1.0 output transform for SDR video; highlights roll off to white
    from_scene_reference: !<BuiltinTransform> {style: ACES-OUTPUT - ACES2065-1_to_CIE-XYZ-D65 - SDR-VIDEO_1.0}

display_colorspaces:
  - !<ColorSpace>
    name: CIE XYZ-D65
    isdata: false

  - !<ColorSpace>
    name: sRGB Display
    description: IEC 61966-2-1
    isdata: false
    from_display_reference: !<BuiltinTransform> {style: DISPLAY - CIE-XYZ-D65_to_sRGB}

  - !<ColorSpace>
    name: Rec.1886 Rec.709 Display
    description: HD television, gamma 2.4
    isdata: false
    from_display_reference: !<BuiltinTransform> {style: DISPLAY - CIE-XYZ-D65_to_REC.1886-REC.709}

  - !<ColorSpace>
    name: P3-D65 Display
    description: P3 primaries, D65 white, gamma 2.6
    isdata: false
    from_display_reference: !<BuiltinTransform> {style: DISPLAY - CIE-XYZ-D65_to_G2.6-P3-D65}

colorspaces:
  - !<ColorSpace>
    name: ACES2065-1
    aliases: [lin_ap0]
    encoding: scene-linear
    isdata: false

  - !<ColorSpace>
    name: ACEScg
    aliases: [lin_ap1]
    encoding: scene-linear
    isdata: false
    to_scene_reference: !<BuiltinTransform> {style: ACEScg_to_ACES2065-1}

  - !<ColorSpace>
    name: ACEScct
    encoding: log
    isdata: false
    to_scene_reference: !<BuiltinTransform> {style: ACEScct_to_ACES2065-1}

  - !<ColorSpace>
    name: lin_rec709
    aliases: [Linear Rec.709 (sRGB), lin_srgb, lin_rec709_scene]
    description: The working space
    encoding: scene-linear
    isdata: false
    to_scene_reference: !<GroupTransform>
      children:
        - !<BuiltinTransform> {style: UTILITY - ACES-AP1_to_LINEAR-REC709_BFD, direction: inverse}
        - !<BuiltinTransform> {style: ACEScg_to_ACES2065-1}

  - !<ColorSpace>
    name: srgb_texture
    aliases: [sRGB - Texture, srgb_tx, srgb_rec709_scene]
    description: The usual encoding of 8-bit images
    encoding: sdr-video
    isdata: false
    to_scene_reference: !<GroupTransform>
      children:
        - !<ExponentWithLinearTransform> {gamma: 2.4, offset: 0.055}
        - !<BuiltinTransform> {style: UTILITY - ACES-AP1_to_LINEAR-REC709_BFD, direction: inverse}
        - !<BuiltinTransform> {style: ACEScg_to_ACES2065-1}

  - !<ColorSpace>
    name: raw
    description: Data that are not colors
    encoding: data
    isdata: true
)";

} // namespace strobe
