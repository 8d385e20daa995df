#pragma once

#include <array>
#include <bitset>
#include <span>
#include <vector>

#include "modules/core/map/label_palette.hpp"
#include "modules/mesh/labelled_mesh.hpp"
#include "modules/objects/map_object.hpp"
#include "modules/objects/objects_config.hpp"

namespace km {

/// Labels whose surfaces are objects.
using ObjectLabels = std::bitset<256>;

/// All labels of the palette except for 0 and the classes named in `background`. Upper and lower
/// case are equal.
[[nodiscard]] ObjectLabels object_labels(const LabelPalette& palette,
                                         std::span<const std::string> background);

/// The objects of a mesh in `world`, which has z up: faces of one label whose vertices are
/// connected by faces or at most config.gap_m apart. A face has the label of
/// LabelledMesh::face_label(). `seen_by` has the first and last keyframe of each vertex. The views
/// of an object are the keyframes in the union of these intervals: an upper bound of the keyframes
/// that saw it. The keyframe of an object is the median of the last keyframes of its vertices.
/// Objects are sorted by label and first face. Time proportional to the mesh, if vertices are not
/// much closer than gap_m. Throws std::invalid_argument if `seen_by` or labels do not fit the
/// vertices.
[[nodiscard]] std::vector<MapObject> extract_objects(
    const LabelledMesh& mesh, std::span<const std::array<KeyframeIndex, 2>> seen_by, RobotId robot,
    const ObjectLabels& labels, const ObjectsConfig& config);

}  // namespace km
