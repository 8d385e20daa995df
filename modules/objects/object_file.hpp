#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "modules/core/map/label_palette.hpp"
#include "modules/objects/map_object.hpp"

namespace km {

/// An object of a file, with the name of its class.
struct NamedObject {
  std::string name;
  ObjectBox box;
};

/// Content of objects.json: for each object its layer, class, label, box in `world` (centre and
/// size [m], yaw [rad]), surface, views, robots, and the keyframe with which it moves.
[[nodiscard]] std::string objects_json(const ObjectList& list, const LabelPalette& palette);

/// Name of a class, or "label 7" if the palette lacks it.
[[nodiscard]] std::string class_name(const LabelPalette& palette, LabelId label);

/// The objects of objects.json, or of the true objects of the simulator, which have only class and
/// box. Entries of other layers are left out. Throws std::runtime_error that names the file, and
/// the entry that is unusable.
[[nodiscard]] std::vector<NamedObject> read_objects(const std::filesystem::path& file);

/// The label, box and robots of each object of objects.json, with the anchor. Throws as
/// read_objects() does, also for a label or a robot id out of range.
[[nodiscard]] ObjectList read_object_list(const std::filesystem::path& file);

}  // namespace km
