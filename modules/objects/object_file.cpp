#include "modules/objects/object_file.hpp"

#include <array>
#include <cstdint>
#include <limits>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "modules/core/io/json.hpp"

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

ObjectBox box_of(const Json& object) {
  return {vector_of(object.at("center_m")), object.at("yaw_rad").get<double>(),
          vector_of(object.at("size_m"))};
}

template <typename T>
T in_range(const Json& json) {
  const auto value = json.get<std::int64_t>();
  if (value < 0 || value > std::numeric_limits<T>::max())
    throw std::out_of_range(json.dump() + " is out of range");
  return static_cast<T>(value);
}

// Calls `take` with each object. Other layers are left out.
template <typename Take>
void for_each_object(const Json& json, const std::filesystem::path& file, const Take& take) {
  std::size_t entry = 0;
  try {
    for (const Json& object : json.at("objects")) {
      if (object.value("layer", kObjectLayer) == kObjectLayer) take(object);
      ++entry;
    }
  } catch (const std::exception& error) {
    throw std::runtime_error(file.string() + ": entry " + std::to_string(entry) +
                             " of \"objects\": " + error.what());
  }
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
  std::vector<NamedObject> objects;
  for_each_object(read_json(file), file, [&](const Json& object) {
    objects.push_back({object.at("class").get<std::string>(), box_of(object)});
  });
  return objects;
}

ObjectList read_object_list(const std::filesystem::path& file) {
  const Json json = read_json(file);
  ObjectList list;
  for_each_object(json, file, [&](const Json& object) {
    MapObject& one = list.objects.emplace_back();
    one.label = in_range<LabelId>(object.at("label"));
    one.box = box_of(object);
    for (const Json& robot : object.at("robots")) one.robots.push_back(in_range<RobotId>(robot));
  });
  try {
    list.anchor = in_range<RobotId>(json.at("anchor"));
  } catch (const std::exception& error) {
    throw std::runtime_error(file.string() + ": \"anchor\": " + error.what());
  }
  return list;
}

}  // namespace km
