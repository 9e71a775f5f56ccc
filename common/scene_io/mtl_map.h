// Reader of statements in MTL files that name an image.
#pragma once

#include "common/scene_io/mtl.h"
#include "common/scene_io/text_lines.h"

namespace lightmill {

bool is_map(std::string_view keyword);

/// Reads a statement such as `map_Kd -s 2 2 -clamp on wood grain.png`: options, then a file name that may have blanks.
/// Unsupported options are added to the material's `unused`.
Status read_map(const StatementReader& lines, const Statement& statement, MtlMaterial& material);

}  // namespace lightmill
