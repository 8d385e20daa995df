#include "modules/objects/object_file.hpp"

#include <nlohmann/json.hpp>
#include <stdexcept>

#include "modules/core/json.hpp"

namespace km {
namespace {

constexpr const char* kObjectLayer = "object";

Json numbers(const Eigen::Vector3d& v) {
  return {v.x(), v.y(), v.z()};
}

Eigen::Vector3d vector_of(const Json& json) {
  const auto values = json.get<std::array<double, 3>>();
  return {values[0], values[1], values[2]};
}

}  // namespace

std::string class_name(const LabelPalette& palette, LabelId label) {
  const LabelClass* const known = palette.find(label);
  return known != nullptr ? known->name : "label " + std::to_string(label);
}

std::string objects_json(const ObjectList& list, const LabelPalette& palette) {
  Json objects = Json::array();
  for (const MapObject& object : list.objects)
    objects.push_back({{"layer", kObjectLayer},
                       {"class", class_name(palette, object.label)},
                       {"label", object.label},
                       {"center_m", numbers(object.box.center)},
                       {"yaw_rad", object.box.yaw_rad},
                       {"size_m", numbers(object.box.size_m)},
                       {"surface_m2", object.surface_m2},
                       {"views", object.views},
                       {"robots", object.robots},
                       {"keyframe", {object.keyframe.robot, object.keyframe.index}}});
  return json_text({{"anchor", list.anchor}, {"objects", std::move(objects)}});
}

std::vector<NamedObject> read_objects(const std::filesystem::path& file) {
  const Json json = read_json(file);
  std::vector<NamedObject> objects;
  std::size_t entry = 0;
  try {
    for (const Json& object : json.at("objects")) {
      if (object.value("layer", kObjectLayer) == kObjectLayer)
        objects.push_back({object.at("class").get<std::string>(),
                           {vector_of(object.at("center_m")), object.at("yaw_rad").get<double>(),
                            vector_of(object.at("size_m"))}});
      ++entry;
    }
  } catch (const Json::exception& error) {
    throw std::runtime_error(file.string() + ": entry " + std::to_string(entry) +
                             " of \"objects\": " + error.what());
  }
  return objects;
}

}  // namespace km
