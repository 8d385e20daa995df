#pragma once

#include <string>

#include "modules/evaluation/mesh/mesh_error.hpp"

namespace km {

/// Throws std::invalid_argument, beginning with `name`, for a mesh without surface, with faces that
/// name vertices there are not, or with another number of labels than of vertices.
void check_comparable(const LabelledMesh& mesh, const std::string& name);

/// Throws std::invalid_argument, beginning with `name`, for a label that the palette, called
/// `palette_name`, does not have. Unknown (0) it need not have.
void check_labels(const LabelledMesh& mesh, const std::string& name, const LabelPalette& palette,
                  const std::string& palette_name);

/// Throws std::invalid_argument for options out of range.
void check(const MeshErrorOptions& options);

}  // namespace km
