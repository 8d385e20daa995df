#include "modules/sensors/sensor_yaml.hpp"

#include <yaml-cpp/yaml.h>

#include <Eigen/LU>
#include <cmath>
#include <utility>

#include "modules/core/lie.hpp"
#include "modules/sensors/dataset_reader.hpp"
#include "modules/sensors/text_file.hpp"

namespace km {
namespace {

constexpr double kMaxNonOrthonormality = 1e-3;

std::optional<double> finite_number(const YAML::Node& node) {
  double value = 0.0;
  if (!YAML::convert<double>::decode(node, value) || !std::isfinite(value)) return std::nullopt;
  return value;
}

}  // namespace

struct SensorYaml::Document {
  std::filesystem::path file;
  YAML::Node root;

  YAML::Node at(const char* key) const { return child(root, key); }

  YAML::Node child(const YAML::Node& map, const char* key) const {
    const YAML::Node node = map.IsMap() ? map[key] : YAML::Node(YAML::NodeType::Undefined);
    if (!node || node.IsNull()) throw DatasetError(file.string() + ": key " + key + " is missing");
    return node;
  }

  [[noreturn]] void fail(const YAML::Node& node, const std::string& problem) const {
    throw DatasetError(at_line(file, node.Mark().line + 1) + ": " + problem);
  }

  std::vector<double> numbers(const YAML::Node& node, const std::string& key, std::size_t count,
                              const char* meaning) const {
    if (!node.IsSequence()) fail(node, key + " is not a list of numbers");
    if (node.size() != count)
      fail(node, key + " has " + std::to_string(node.size()) + " numbers, expected " +
                     std::to_string(count) + " (" + meaning + ')');
    std::vector<double> values;
    for (const YAML::Node& element : node) {
      const std::optional<double> value = finite_number(element);
      if (!value) fail(element, key + " holds something that is not a finite number");
      values.push_back(*value);
    }
    return values;
  }
};

SensorYaml::SensorYaml(std::filesystem::path file) {
  std::string text = read_file(file);
  if (text.starts_with('%')) text.front() = '#';  // OpenCV's "%YAML:1.0" is not YAML
  YAML::Node root;
  try {
    root = YAML::Load(text);
  } catch (const YAML::Exception& e) {
    throw DatasetError(at_line(file, e.mark.line + 1) + ": not YAML: " + e.msg);
  }
  if (!root.IsMap()) throw DatasetError(file.string() + ": no keys found");
  document_ = std::make_unique<const Document>(Document{std::move(file), root});
}

SensorYaml::~SensorYaml() = default;

bool SensorYaml::has(const char* key) const {
  const YAML::Node node = document_->root[key];
  return node && !node.IsNull();
}

std::string SensorYaml::word(const char* key) const {
  const YAML::Node node = document_->at(key);
  if (!node.IsScalar()) document_->fail(node, std::string(key) + " is not a word");
  return node.Scalar();
}

std::optional<double> SensorYaml::number(const char* key) const {
  return finite_number(document_->at(key));
}

double SensorYaml::positive(const char* key) const {
  const std::optional<double> value = number(key);
  if (!value || *value <= 0.0) fail(key, std::string(key) + " is not a positive number");
  return *value;
}

double SensorYaml::positive(const char* key, double otherwise) const {
  return has(key) ? positive(key) : otherwise;
}

std::vector<double> SensorYaml::numbers(const char* key, std::size_t count,
                                        const char* meaning) const {
  return document_->numbers(document_->at(key), key, count, meaning);
}

SE3 SensorYaml::extrinsics() const {
  const YAML::Node data = document_->child(document_->at("T_BS"), "data");
  const std::vector<double> values = document_->numbers(data, "T_BS", 16, "4x4, row by row");
  const Eigen::Matrix4d T =
      Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(values.data());
  if (T.row(3) != Eigen::RowVector4d(0, 0, 0, 1))
    document_->fail(data, "T_BS: last row is not 0 0 0 1");

  const Eigen::Matrix3d R = T.topLeftCorner<3, 3>();
  const double error = (R * R.transpose() - Eigen::Matrix3d::Identity()).norm();
  if (error > kMaxNonOrthonormality)
    document_->fail(data, "T_BS is not a rotation: |R R^T - I| = " + std::to_string(error) +
                              ", at most " + std::to_string(kMaxNonOrthonormality) +
                              " is accepted");
  if (R.determinant() < 0.0) document_->fail(data, "T_BS is a reflection: det R = -1");
  return make_pose(nearest_rotation(R), T.topRightCorner<3, 1>());
}

void SensorYaml::fail(const char* key, const std::string& problem) const {
  document_->fail(document_->at(key), problem);
}

}  // namespace km
