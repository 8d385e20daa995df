#pragma once

#include <filesystem>

#include "modules/core/map/label_palette.hpp"
#include "modules/mesh/labelled_mesh.hpp"

namespace km {

/// Writes a mesh as binary glTF 2.0 (.glb). Each class is a primitive with a material that has the
/// name and the colour of the class. The material of a label that the palette lacks is white, with
/// a name like "label 7". A mesh without labels has one material, "mesh", and its colours of
/// vertices, if there are any, become COLOR_0. Coordinates are those of the mesh, z up: a node
/// rotates them to the y axis of glTF. Throws std::runtime_error that names the file if it cannot
/// be written, and std::invalid_argument for a mesh without faces.
void write_glb(const std::filesystem::path& file, const LabelledMesh& mesh,
               const LabelPalette& palette);

}  // namespace km
