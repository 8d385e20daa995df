#include "apps/viewer/page_message.hpp"

#include <array>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>
#include <sstream>

#include "modules/core/io/json.hpp"

namespace km {
namespace {

// Rounds to 1 / `scale`, so that JSON has fewer digits.
double rounded_to(double value, double scale) {
  return std::round(value * scale) / scale;
}

double seconds_of(Stamp stamp) {
  return rounded_to(1e-9 * static_cast<double>(stamp), 1e3);
}

Json json_of(const SE3& T) {
  const Eigen::Quaterniond q(T.linear());
  Json json = Json::array();
  for (const double x : {T.translation().x(), T.translation().y(), T.translation().z()})
    json.push_back(rounded_to(x, 1e4));
  for (const double x : {q.x(), q.y(), q.z(), q.w()}) json.push_back(rounded_to(x, 1e5));
  return json;
}

Json json_of(const std::vector<NamedNumber>& numbers) {
  Json json = Json::object();
  for (const NamedNumber& number : numbers) json[number.name] = number.value;
  return json;
}

Json json_of(const Eigen::Vector3f& v) {
  Json json = Json::array();
  for (const float x : v) json.push_back(rounded_to(static_cast<double>(x), 1e3));
  return json;
}

// By ClosureStatus.
constexpr std::array kStatusNames = {"candidate", "verified", "rejected", "kept"};

bool is_of_team(const ViewUpdate& update) {
  const auto* const chunk = std::get_if<MeshChunk>(&update.content);
  return chunk != nullptr && chunk->key.robot != update.robot;
}

// Writes the fields of an update to `json`, and its image, mesh or other bulk data to `data`.
struct Writer {
  Json& json;
  std::string& data;

  void operator()(const RobotSample& state) const {
    json["kind"] = "state";
    json["name"] = state.name;
    json["phase"] = state.phase;
    json["dataset_time_s"] = rounded_to(state.dataset_time_s, 1e3);
    json["keyframes"] = state.keyframes;
    json["skipped_frames"] = state.skipped_frames;
    json["anchor"] = state.anchor;
    json["tentative"] = state.tentative;
    json["round"] = state.round;
    json["cost"] = state.cost;
    json["gradient_norm"] = state.gradient_norm;
    json["cpu_s"] = rounded_to(state.cpu_s, 1e3);
    json["resident_MB"] = rounded_to(state.resident_MB, 10);
    json["links"] = Json::array();
    for (const RobotLink& link : state.links)
      json["links"].push_back({link.robot, rounded_to(link.silent_s, 100)});
    json["sent_bytes"] = json_of(state.sent_bytes);
    json["loads"] = json_of(state.loads);
  }

  void operator()(const ViewPose& pose) const {
    json["kind"] = "pose";
    json["stamp_s"] = seconds_of(pose.stamp);
    json["T_odom_body"] = json_of(pose.T_odom_body);
  }

  void operator()(const ViewKeyframes& keyframes) const {
    json["kind"] = "keyframes";
    json["optimized"] = keyframes.optimized;
    json["anchor"] = keyframes.anchor;
    json["first"] = keyframes.first;
    json["T_world_kf"] = Json::array();
    for (const SE3& T : keyframes.T_world_kf) json["T_world_kf"].push_back(json_of(T));
    json["stamps_s"] = Json::array();
    for (const Stamp stamp : keyframes.stamps) json["stamps_s"].push_back(seconds_of(stamp));
  }

  // Each closure: [robot, keyframe, robot, keyframe, verdict, matches, inliers, reason].
  void operator()(const ViewClosures& closures) const {
    json["kind"] = "closures";
    json["closures"] = Json::array();
    for (const ViewClosure& one : closures.closures)
      json["closures"].push_back({one.id.from.robot, one.id.from.index, one.id.to.robot,
                                  one.id.to.index,
                                  kStatusNames.at(static_cast<std::size_t>(one.verdict)),
                                  one.matches, one.inliers, one.reason});
  }

  void operator()(const MeshChunk& chunk) const {
    json["kind"] = "mesh";
    json["of"] = chunk.key.robot;
    json["cell"] = chunk.key.cell;
    json["part"] = chunk.key.part;
    json["anchor"] = chunk.anchor;
    json["step_m"] = chunk.step_m;
    json["origin"] = chunk.origin;
    json["vertices"] = chunk.offsets.size();
    json["faces"] = chunk.faces.size();
    json["labelled"] = !chunk.labels.empty();
    json["coloured"] = !chunk.colors.empty();
    append(chunk.offsets);
    append(chunk.faces);
    append(chunk.colors);
    append(chunk.labels);
  }

  void operator()(const ViewImage& image) const {
    json["kind"] = "image";
    json["features"] = image.features.size();
    append(image.features);
    append(image.jpeg);
  }

  // Each object: [label, centre, yaw, size, robots].
  void operator()(const ViewObjects& update) const {
    json["kind"] = "objects";
    json["anchor"] = update.anchor;
    json["left_out"] = update.left_out;
    json["objects"] = Json::array();
    for (const ViewObject& one : update.objects)
      json["objects"].push_back({one.label, json_of(one.center),
                                 rounded_to(static_cast<double>(one.yaw_rad), 1e4),
                                 json_of(one.size_m), one.robots});
  }

  void operator()(const ViewRaster& raster) const {
    json["kind"] = "raster";
    json["layer"] = "map_2d";
    json["anchor"] = raster.anchor;
    json["resolution_m"] = raster.resolution_m;
    json["origin"] = raster.origin;
    json["width"] = raster.width;
    json["height"] = raster.height;
    append(raster.runs);
  }

  template <typename T>
  void append(const std::vector<T>& values) const {
    const std::size_t begin = data.size();
    data.resize(begin + values.size() * sizeof(T));
    if (!values.empty()) std::memcpy(data.data() + begin, values.data(), values.size() * sizeof(T));
  }
};

}  // namespace

PageMessage page_message(const ViewUpdate& update, std::uint64_t number) {
  std::ostringstream boot;
  boot << std::hex << update.boot;
  Json json = {{"n", number},
               {"t", static_cast<double>(update.sent / 1000) * 1e-3},
               {"robot", update.robot},
               {"boot", boot.str()}};
  std::string data;
  std::visit(Writer{json, data}, update.content);
  if (is_of_team(update)) json["team"] = true;
  // Invalid UTF-8 in a robot's name or reason must not end the viewer.
  std::string text = json.dump(-1, ' ', false, Json::error_handler_t::replace);
  const bool binary = std::holds_alternative<MeshChunk>(update.content) ||
                      std::holds_alternative<ViewImage>(update.content) ||
                      std::holds_alternative<ViewRaster>(update.content);
  if (!binary) return {false, std::move(text)};
  while ((text.size() + sizeof(std::uint32_t)) % 4 != 0) text += ' ';
  const auto length = static_cast<std::uint32_t>(text.size());
  std::string bytes(sizeof(length), '\0');
  std::memcpy(bytes.data(), &length, sizeof(length));
  return {true, bytes + text + data};
}

std::string hello_message(PageSource source, const std::string& title,
                          const LabelPalette& palette) {
  Json json = {{"kind", "hello"},
               {"source", source == PageSource::kTeam ? "live" : "run"},
               {"title", title},
               {"labels", Json::array()}};
  for (const LabelClass& one : palette.classes())
    json["labels"].push_back({{"id", one.id}, {"name", one.name}, {"color", one.color}});
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace km
