// The library strobe: scenes, renders and pictures in memory. See examples/embed and docs/embedding.md.
#pragma once

#include "api/render_picture.h"
#include "api/scene_model.h"
#include "core/util/error.h"
#include "core/util/version.h"
