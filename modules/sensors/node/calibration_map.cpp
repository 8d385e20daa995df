#include "modules/sensors/node/calibration_map.hpp"

#include <algorithm>
#include <cmath>
#include <string_view>
#include <utility>

#include "modules/core/calibration_limits.hpp"
#include "modules/core/text_rows.hpp"
#include "modules/sensors/text_file.hpp"

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
  if (text.starts_with('%')) text.front() = '#';  // OpenCV's "%YAML:1.0" is not YAML
  if (const auto first = text.find_first_not_of(" \t\r\n");
      first != text.npos && text[first] == '{')
    std::replace(text.begin(), text.end(), '\t', ' ');  // JSON may be indented by tabs
  try {
    return YAML::Load(text);
  } catch (const YAML::Exception& e) {
    throw DatasetError(at_line(file, e.mark.line + 1) + ": not YAML: " + readable(e.msg));
  }
}

}  // namespace

CalibrationMap::CalibrationMap(const std::filesystem::path& file)
    : CalibrationMap(std::make_shared<const std::filesystem::path>(file), load(file)) {
  if (!node_.IsMap()) throw DatasetError(file.string() + ": no keys found");
}

bool CalibrationMap::has(const char* key) const {
  const YAML::Node node = node_[key];
  return node && !node.IsNull();
}

bool CalibrationMap::is_list(const char* key) const {
  return has(key) && node_[key].IsSequence();
}

const char* CalibrationMap::first_of(std::initializer_list<const char*> keys) const {
  for (const char* key : keys)
    if (has(key)) return key;
  return nullptr;
}

YAML::Node CalibrationMap::child(const char* key) const {
  if (!has(key)) fail(node_, std::string("key ") + key + " is missing");
  return node_[key];
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
  fail(has(key) ? node_[key] : node_, problem);
}

void CalibrationMap::fail(const YAML::Node& node, const std::string& problem) const {
  throw DatasetError(at_line(file(), node.Mark().line + 1) + ": " + readable(problem));
}

std::string CalibrationMap::place_of(const char* key) const {
  return at_line(file(), child(key).Mark().line + 1);
}

}  // namespace km
