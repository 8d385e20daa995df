#include "modules/sensors/node/calibration_map.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "modules/core/camera/calibration_limits.hpp"
#include "modules/core/io/text_rows.hpp"
#include "modules/sensors/text_file.hpp"
#include "runtime/yaml_config.hpp"

namespace km {
namespace {

std::optional<double> finite_number(const YAML::Node& node) {
  double value = 0.0;
  if (!YAML::convert<double>::decode(node, value) || !std::isfinite(value)) return std::nullopt;
  return value;
}

YAML::Node load(const std::filesystem::path& file) {
  std::string text = read_file(file);
  if (text.starts_with(kByteOrderMark)) text.erase(0, kByteOrderMark.size());
  if (text.find('\n') == text.npos) std::ranges::replace(text, '\r', '\n');
  if (text.starts_with('%')) text.front() = '#';  // OpenCV's "%YAML:1.0" is not YAML
  if (const auto first = text.find_first_not_of(" \t\r\n");
      first != text.npos && text[first] == '{')
    std::replace(text.begin(), text.end(), '\t', ' ');  // JSON may be indented by tabs
  try {
    return YAML::Load(text);
  } catch (const YAML::Exception& e) {
    throw DatasetError(at_line(file, e.mark.line + 1) + ": not YAML: " + readable(e.msg) +
                       (text.find('\t') != text.npos ? "; YAML does not allow tabs" : ""));
  }
}

// Intrinsics of a camera_model.
struct Projection {
  const char* name;
  std::size_t count;    // number of intrinsics
  const char* meaning;  // names of the intrinsics in messages
};
constexpr Projection kProjections[] = {{"pinhole", 4, "fu, fv, cu, cv"},
                                       {"omni", 5, "xi, fu, fv, cu, cv"},
                                       {"ds", 6, "xi, alpha, fu, fv, cu, cv"},
                                       {"eucm", 6, "alpha, beta, fu, fv, cu, cv"}};

const Projection& read_projection(const CalibrationMap& map) {
  const std::string name = map.word("camera_model");
  for (const Projection& projection : kProjections)
    if (name == projection.name) return projection;
  map.fail("camera_model",
           "camera_model '" + name + "' is not supported, only pinhole, omni, ds and eucm");
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

CalibrationMap::CalibrationMap(const std::filesystem::path& file)
    : CalibrationMap(std::make_shared<const std::filesystem::path>(file), load(file)) {
  if (!node_->IsMap()) throw DatasetError(file.string() + ": no keys found");
}

CalibrationMap::CalibrationMap(std::shared_ptr<const std::filesystem::path> file,
                               const YAML::Node& node)
    : file_(std::move(file)), node_(std::make_shared<const YAML::Node>(node)) {}

bool CalibrationMap::has(const char* key) const {
  const YAML::Node node = (*node_)[key];
  return node && !node.IsNull();
}

bool CalibrationMap::is_list(const char* key) const {
  return has(key) && (*node_)[key].IsSequence();
}

const char* CalibrationMap::first_of(std::initializer_list<const char*> keys) const {
  for (const char* key : keys)
    if (has(key)) return key;
  return nullptr;
}

YAML::Node CalibrationMap::child(const char* key) const {
  if (!has(key)) fail(*node_, std::string("key ") + key + " is missing");
  return (*node_)[key];
}

CalibrationMap CalibrationMap::map(const char* key) const {
  const YAML::Node node = child(key);
  if (!node.IsMap()) fail(node, std::string(key) + " has no keys below it");
  return {file_, node};
}

std::vector<CalibrationMap> CalibrationMap::maps(const char* key) const {
  const YAML::Node node = child(key);
  if (!node.IsSequence()) fail(node, std::string(key) + " is not a list");
  std::vector<CalibrationMap> result;
  for (const YAML::Node& element : node) {
    if (!element.IsMap()) fail(element, std::string(key) + " contains an element without keys");
    result.push_back({file_, element});
  }
  return result;
}

std::string CalibrationMap::word(const char* key) const {
  const YAML::Node node = child(key);
  if (!node.IsScalar()) fail(node, std::string(key) + " is not a word");
  return node.Scalar();
}

std::optional<double> CalibrationMap::number(const char* key) const {
  return finite_number(child(key));
}

double CalibrationMap::number(const char* key, const Bounds<double>& bounds) const {
  const std::optional<double> value = number(key);
  if (!value || !bounds.contains(*value))
    fail(key, std::string(key) + " is not a number within " + bounds.text());
  return *value;
}

double CalibrationMap::number(const char* key, const Bounds<double>& bounds,
                              double otherwise) const {
  return has(key) ? number(key, bounds) : otherwise;
}

void CalibrationMap::append(const YAML::Node& list, const char* name,
                            std::vector<double>& values) const {
  if (!list.IsSequence()) fail(list, std::string(name) + " is not a list of numbers");
  for (const YAML::Node& element : list) {
    const std::optional<double> value = finite_number(element);
    if (!value)
      fail(element, std::string(name) + " contains an element that is not a finite number");
    values.push_back(*value);
  }
}

std::vector<double> CalibrationMap::numbers(const YAML::Node& node, const char* name) const {
  std::vector<double> values;
  if (node.IsSequence() && node.size() > 0 && node[0].IsSequence()) {
    for (const YAML::Node& row : node) append(row, name, values);
  } else {
    append(node, name, values);
  }
  return values;
}

std::vector<double> CalibrationMap::numbers(const char* key) const {
  return numbers(child(key), key);
}

std::vector<double> CalibrationMap::numbers(const char* key, std::size_t count,
                                            const char* meaning) const {
  std::vector<double> values = numbers(key);
  if (values.size() != count)
    fail(key, std::string(key) + " has " + std::to_string(values.size()) + " numbers, expected " +
                  std::to_string(count) + " (" + meaning + ')');
  return values;
}

std::vector<std::vector<double>> CalibrationMap::lists(const char* key) const {
  const YAML::Node node = child(key);
  if (!node.IsSequence()) fail(node, std::string(key) + " is not a list");
  std::vector<std::vector<double>> result;
  for (const YAML::Node& element : node) append(element, key, result.emplace_back());
  return result;
}

SE3 CalibrationMap::transform(const char* key, const char* name) const {
  const std::vector<double> values = numbers(child(key), name);
  if (values.size() != 16)
    fail(key, std::string(name) + " has " + std::to_string(values.size()) +
                  " numbers, expected 16 (4x4, row by row)");
  const Eigen::Matrix4d T =
      Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(values.data());
  if (const auto problem = transform_problem(T)) fail(key, name + *problem);
  return rigid_transform(T);
}

void CalibrationMap::fail(const char* key, const std::string& problem) const {
  fail(has(key) ? (*node_)[key] : *node_, problem);
}

void CalibrationMap::fail(const YAML::Node& node, const std::string& problem) const {
  throw DatasetError(at_line(file(), node.Mark().line + 1) + ": " + readable(problem));
}

std::string CalibrationMap::place_of(const char* key) const {
  return at_line(file(), child(key).Mark().line + 1);
}

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
    const bool is_enhanced = model == "eucm";
    const std::vector<double> k =
        is_enhanced ? std::vector{0.0, K[0], K[1]} : std::vector{K[0], K[1]};
    camera.lens = lens_of(map, "intrinsics", LensModel::kDoubleSphere, k);
    if (is_enhanced) return camera;
  }
  camera.fx /= 1.0 + K[0];
  camera.fy /= 1.0 + K[0];
  return camera;
}

}  // namespace km
