#include "modules/sensors/node/read_camera.hpp"

#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "modules/core/calibration_limits.hpp"

namespace km {
namespace {

// Intrinsics of a camera_model.
struct Projection {
  const char* name;
  std::size_t count;    // number of intrinsics
  const char* meaning;  // names of the intrinsics in messages
};
constexpr Projection kProjections[] = {{"pinhole", 4, "fu, fv, cu, cv"},
                                       {"omni", 5, "xi, fu, fv, cu, cv"},
                                       {"ds", 6, "xi, alpha, fu, fv, cu, cv"}};

const Projection& read_projection(const CalibrationMap& map) {
  const std::string name = map.word("camera_model");
  for (const Projection& projection : kProjections)
    if (name == projection.name) return projection;
  map.fail("camera_model",
           "camera_model '" + name + "' is not supported, only pinhole, omni and ds");
}

[[noreturn]] void refuse_distortion(const CalibrationMap& map, const std::string& name,
                                    const std::string& supported) {
  map.fail("distortion_model", "distortion_model '" + name +
                                   "' is not supported with camera_model " +
                                   map.word("camera_model") + ", only " + supported);
}

void read_resolution(const CalibrationMap& map, Camera& camera) {
  const auto resolution = map.numbers("resolution", 2, "width and height");
  if (const auto problem = resolution_problem(resolution[0], resolution[1]))
    map.fail("resolution", "resolution: " + *problem);
  camera.width = static_cast<int>(resolution[0]);
  camera.height = static_cast<int>(resolution[1]);
}

// All numbers of `intrinsics`. The last four are stored in `camera` too.
std::vector<double> read_intrinsics(const CalibrationMap& map, const Projection& projection,
                                    Camera& camera) {
  std::vector<double> K = map.numbers("intrinsics", projection.count, projection.meaning);
  const std::size_t f = projection.count - 4;
  camera.fx = K[f], camera.fy = K[f + 1], camera.cx = K[f + 2], camera.cy = K[f + 3];
  check_intrinsics(map, "intrinsics", camera);
  return K;
}

// The distortion on an image plane, four or more coefficients in the order of LensModel.
struct Distortion {
  LensModel model = LensModel::kRadialTangential;
  std::vector<double> k = {0.0, 0.0, 0.0, 0.0};
};

Distortion read_distortion(const CalibrationMap& map, const char* key) {
  const std::string name = map.word("distortion_model");
  if (name == "none") {
    if (map.has(key) && !map.numbers(key).empty())
      map.fail(key, std::string(key) + " are given, but distortion_model is none");
    return {};
  }
  if (name == "equidistant")
    return {LensModel::kEquidistant, map.numbers(key, 4, "k1, k2, k3, k4")};
  if (name != "radtan" && name != "radial-tangential")
    refuse_distortion(map, name, "radial-tangential, equidistant and none");
  std::vector<double> k = map.numbers(key);
  if (k.size() != 4 && k.size() != 5 && k.size() != 8)
    map.fail(key, std::string(key) + " has " + std::to_string(k.size()) +
                      " numbers, expected 4, 5 or 8 (k1, k2, p1, p2, k3, k4, k5, k6)");
  return {LensModel::kRadialTangential, k};
}

}  // namespace

Lens lens_of(const CalibrationMap& map, const char* key, LensModel model,
             const std::vector<double>& coefficients) {
  if (const auto problem = coefficients_problem(coefficients))
    map.fail(key, std::string(key) + ": " + *problem);
  try {
    return Lens(model, coefficients);
  } catch (const std::invalid_argument& error) {
    map.fail(key, std::string(key) + ": " + error.what());
  }
}

void check_intrinsics(const CalibrationMap& map, const char* key, const Camera& camera) {
  if (const auto problem = intrinsics_problem(camera))
    map.fail(key, std::string(key) + ": " + *problem);
}

void read_pinhole(const CalibrationMap& map, Camera& camera) {
  read_resolution(map, camera);
  read_intrinsics(map, kProjections[0], camera);
}

DepthRange read_depth_range(const CalibrationMap& yaml, double max_m) {
  DepthRange range;
  range.max_m = yaml.number("max_range_m", kDepthRange_m, max_m);
  if (!yaml.has("min_range_m")) return range;
  const std::optional<double> min_m = yaml.number("min_range_m");
  if (!min_m || *min_m < 0.0 || *min_m >= range.max_m)
    yaml.fail("min_range_m", "min_range_m is not a number from 0 to below max_range_m");
  range.min_m = *min_m;
  return range;
}

Camera read_camera(const CalibrationMap& map, const char* coefficients_key) {
  Camera camera;
  read_resolution(map, camera);
  const Projection& projection = read_projection(map);
  const std::vector<double> K = read_intrinsics(map, projection, camera);
  const Distortion distortion = read_distortion(map, coefficients_key);
  const std::string model = projection.name;
  if (model == "pinhole") {
    camera.lens = lens_of(map, coefficients_key, distortion.model, distortion.k);
    return camera;
  }
  if (model == "omni") {
    if (distortion.model != LensModel::kRadialTangential || distortion.k.size() != 4)
      refuse_distortion(map, map.word("distortion_model"),
                        "radial-tangential of four coefficients and none");
    std::vector<double> k = {K[0]};
    k.insert(k.end(), distortion.k.begin(), distortion.k.end());
    camera.lens = lens_of(map, "intrinsics", LensModel::kOmnidirectional, k);
  } else {
    if (map.word("distortion_model") != "none")
      refuse_distortion(map, map.word("distortion_model"), "none");
    camera.lens = lens_of(map, "intrinsics", LensModel::kDoubleSphere, {K[0], K[1]});
  }
  camera.fx /= 1.0 + K[0];
  camera.fy /= 1.0 + K[0];
  return camera;
}

}  // namespace km
