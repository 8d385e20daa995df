#include "modules/recorded_graph/jrl_io.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <stdexcept>
#include <utility>

#include "modules/core/data/measurement_limits.hpp"
#include "modules/core/io/input_file.hpp"
#include "modules/core/io/text_rows.hpp"
#include "modules/recorded_graph/g2o_io.hpp"
#include "modules/recorded_graph/text_fields.hpp"

namespace km {
namespace {

// Largest accepted difference of mirrored elements of a covariance, relative to its largest
// element.
constexpr double kSymmetry = 1e-6;

// A value of the document and its place there, as a JSON pointer. Every failure throws
// std::runtime_error "file: place: what". Borrows the value and the name of the file.
class JsonPlace {
 public:
  JsonPlace(const nlohmann::json& value, std::string place, const std::string& file)
      : value_(&value), place_(std::move(place)), file_(&file) {}

  [[noreturn]] void fail(const std::string& what) const {
    throw std::runtime_error(*file_ + ": " + (place_.empty() ? "/" : place_) + ": " +
                             readable(what));
  }

  [[nodiscard]] std::optional<JsonPlace> find(const std::string& name) const {
    if (!value_->is_object()) fail("is not an object: " + text());
    const auto member = value_->find(name);
    if (member == value_->end()) return std::nullopt;
    return JsonPlace(*member, place_ + '/' + name, *file_);
  }
  [[nodiscard]] JsonPlace operator[](const std::string& name) const {
    auto member = find(name);
    if (!member) fail("has no \"" + name + '"');
    return *std::move(member);
  }

  [[nodiscard]] bool is_list() const { return value_->is_array(); }
  [[nodiscard]] bool is_map() const { return value_->is_object(); }
  [[nodiscard]] std::vector<JsonPlace> list() const {
    if (!value_->is_array()) fail("is not a list: " + text());
    std::vector<JsonPlace> elements;
    for (std::size_t i = 0; i < value_->size(); ++i)
      elements.emplace_back((*value_)[i], place_ + '/' + std::to_string(i), *file_);
    return elements;
  }
  [[nodiscard]] std::vector<std::pair<std::string, JsonPlace>> members() const {
    std::vector<std::pair<std::string, JsonPlace>> members;
    for (const auto& [name, value] : value_->items())
      members.emplace_back(name, JsonPlace(value, place_ + '/' + readable(name, 40), *file_));
    return members;
  }
  // The elements of a list of exactly two elements.
  [[nodiscard]] std::pair<JsonPlace, JsonPlace> pair() const {
    auto elements = list();
    if (elements.size() != 2) fail("is not a pair: " + text());
    return {std::move(elements[0]), std::move(elements[1])};
  }

  [[nodiscard]] bool is_string() const { return value_->is_string(); }
  [[nodiscard]] const std::string& string() const {
    if (!value_->is_string()) fail("is not a text: " + text());
    return value_->get_ref<const std::string&>();
  }
  [[nodiscard]] std::uint64_t integer(std::uint64_t max) const {
    if (!value_->is_number_unsigned() || value_->get<std::uint64_t>() > max)
      fail("is not an integer from 0 to " + std::to_string(max) + ": " + text());
    return value_->get<std::uint64_t>();
  }
  // The numbers of a list of exactly N finite numbers.
  template <int N>
  [[nodiscard]] Eigen::Matrix<double, N, 1> numbers(const Bounds<double>& bounds) const {
    if (!value_->is_array() || value_->size() != N)
      fail("is not a list of " + std::to_string(N) + " numbers: " + text());
    Eigen::Matrix<double, N, 1> numbers;
    for (int i = 0; i < N; ++i) {
      const auto& element = (*value_)[static_cast<std::size_t>(i)];
      if (!element.is_number())
        fail("element " + std::to_string(i) + " is not a number: " + text_of(element));
      numbers(i) = element.template get<double>();
      if (!bounds.contains(numbers(i)))
        fail("element " + std::to_string(i) + ", " + shortest_text(numbers(i)) + ", is outside " +
             bounds.text());
    }
    return numbers;
  }

  [[nodiscard]] std::string text() const { return text_of(*value_); }

 private:
  // Shows a list or an object by kind and size only, because it may be too large for a message.
  static std::string text_of(const nlohmann::json& value) {
    if (value.is_structured())
      return std::string(value.is_array() ? "a list" : "an object") + " of " +
             std::to_string(value.size());
    return value.dump(-1, ' ', true, nlohmann::json::error_handler_t::replace);
  }

  const nlohmann::json* value_;
  std::string place_;
  const std::string* file_;
};

std::optional<RobotId> robot_of_code(std::uint64_t code) {
  if (code == 0 || code > 0xff) return std::nullopt;
  const auto id = keyframe_of_key(code << 56U);
  return id ? std::optional(id->robot) : std::nullopt;
}

std::optional<RobotId> robot_of_letter(const std::string& letter) {
  if (letter.size() != 1) return std::nullopt;
  return robot_of_code(static_cast<unsigned char>(letter[0]));
}

RobotId read_robot(const JsonPlace& place) {
  constexpr std::uint64_t kAnyCode = 0xff;
  const auto robot =
      place.is_string() ? robot_of_letter(place.string()) : robot_of_code(place.integer(kAnyCode));
  if (!robot) place.fail("is not a letter or its character code: " + place.text());
  return *robot;
}

SE3 read_pose(const JsonPlace& place, const Bounds<double>& bounds_m) {
  const JsonPlace type = place["type"];
  if (type.string() != "Pose3") type.fail("is not Pose3: " + type.text());
  const Eigen::Vector3d t = place["translation"].numbers<3>(bounds_m);
  const JsonPlace rotation = place["rotation"];
  constexpr Bounds<double> kComponent{-1.0 - kUnitTolerance, 1.0 + kUnitTolerance};
  const Eigen::Vector4d wxyz = rotation.numbers<4>(kComponent);
  if (!(std::abs(wxyz.norm() - 1.0) <= kUnitTolerance))
    rotation.fail("the quaternion has length " + shortest_text(wxyz.norm()));
  const Eigen::Quaterniond q(wxyz(0), wxyz(1), wxyz(2), wxyz(3));
  return make_pose(q.normalized().toRotationMatrix(), t);
}

Matrix6 read_covariance(const JsonPlace& place) {
  const Bounds<double> any{-kAxisVariance.max, kAxisVariance.max};
  const Eigen::Matrix<double, 36, 1> rows = place.numbers<36>(any);
  const Eigen::Map<const Eigen::Matrix<double, 6, 6, Eigen::RowMajor>> given(rows.data());
  const double error = (given - given.transpose()).cwiseAbs().maxCoeff();
  if (!(error <= kSymmetry * given.cwiseAbs().maxCoeff()))
    place.fail("is not symmetric: mirrored elements differ by " + shortest_text(error));
  Matrix6 Sigma = 0.5 * (given + given.transpose());
  const Eigen::LLT<Matrix6> llt(Sigma);
  if (llt.info() != Eigen::Success) place.fail("is not positive definite");
  for (const double variance : Sigma.diagonal())
    if (!kAxisVariance.contains(variance))
      place.fail("has a variance of " + shortest_text(variance) + ", outside " +
                 kAxisVariance.text());
  for (const double trace :
       {Sigma.topLeftCorner<3, 3>().trace(), Sigma.bottomRightCorner<3, 3>().trace()})
    if (!kVariance.contains(trace))
      place.fail("has a trace of " + shortest_text(trace) +
                 " for rotation or translation, outside " + kVariance.text());
  return Sigma;
}

// Place of a measurement in the document.
struct FactorPlace {
  RobotId robot = 0;
  std::size_t entry = 0;
  std::size_t measurement = 0;
  auto operator<=>(const FactorPlace&) const = default;
};

class JrlReader {
 public:
  JrlGraph read(const JsonPlace& document) {
    read_robots(document["robots"]);
    const JsonPlace measurements = document["measurements"];
    for (const auto& [robot, entries] : by_robot(measurements)) read_entries(robot, entries);
    find_chains(measurements);
    check_keys();
    if (const auto values = document.find("groundtruth")) read_values(*values, graph_.truth);
    read_labels(document);
    return std::move(graph_);
  }

 private:
  using ByRobot = std::vector<std::pair<RobotId, JsonPlace>>;

  // A key in the document, checked by check_keys() once all odometry is known.
  struct Named {
    KeyframeId id;
    JsonPlace place;
  };

  void read_robots(const JsonPlace& place) {
    for (const JsonPlace& element : place.list()) {
      const RobotId robot = read_robot(element);
      if (!robots_.insert(robot).second) element.fail("names a robot twice: " + element.text());
    }
    if (robots_.empty()) place.fail("names no robot");
    graph_.robots.assign(robots_.begin(), robots_.end());
  }

  // Reads {"a": value, ...} or [["a", value], ...], in any order. The result is ascending by robot.
  [[nodiscard]] ByRobot by_robot(const JsonPlace& place) const {
    std::map<RobotId, JsonPlace> values;
    const auto add = [&](RobotId robot, JsonPlace value) {
      if (!robots_.contains(robot)) value.fail("is of a robot that /robots does not name");
      const auto [at, is_new] = values.emplace(robot, std::move(value));
      if (!is_new) at->second.fail("is followed by a second one of the same robot");
    };
    if (place.is_map())
      for (auto& [name, value] : place.members()) {
        const auto robot = robot_of_letter(name);
        if (!robot) value.fail("is not of a robot: \"" + name + "\" is not a letter");
        add(*robot, value);
      }
    else
      for (const JsonPlace& element : place.list()) {
        auto [robot, value] = element.pair();
        add(read_robot(robot), std::move(value));
      }
    return {values.begin(), values.end()};
  }

  [[nodiscard]] KeyframeId read_key(const JsonPlace& place) const {
    return keyframe_of(place.integer(std::numeric_limits<std::uint64_t>::max()), place);
  }

  [[nodiscard]] KeyframeId keyframe_of(std::uint64_t key, const JsonPlace& place) const {
    const auto id = (key >> 56U) == 0 ? std::nullopt : keyframe_of_key(key);
    if (!id) place.fail(std::to_string(key) + " is not a letter and an index below 2^32");
    if (!robots_.contains(id->robot))
      place.fail(std::to_string(key) + " is of a robot that /robots does not name");
    return *id;
  }

  void read_entries(RobotId robot, const JsonPlace& place) {
    const std::vector<JsonPlace> entries = place.list();
    for (std::size_t i = 0; i < entries.size(); ++i) {
      const Stamp stamp = static_cast<Stamp>(entries[i]["stamp"].integer(
          static_cast<std::uint64_t>(std::numeric_limits<Stamp>::max())));
      const auto [first, is_new] = first_stamp_.emplace(robot, stamp);
      if (!is_new) first->second = std::min(first->second, stamp);
      const std::vector<JsonPlace> measurements = entries[i]["measurements"].list();
      for (std::size_t j = 0; j < measurements.size(); ++j)
        read_measurement({robot, i, j}, stamp, measurements[j]);
    }
  }

  void read_measurement(const FactorPlace& at, Stamp stamp, const JsonPlace& place) {
    const JsonPlace type = place["type"];
    if (type.string() == "PriorFactorPose3")
      read_prior(place);
    else if (type.string() == "BetweenFactorPose3")
      read_between(at, stamp, place);
    else
      type.fail(type.text() + " is not read: PriorFactorPose3 and BetweenFactorPose3 are");
  }

  void read_prior(const JsonPlace& place) {
    named_.push_back({read_key(place["key"]), place["key"]});
    (void)read_pose(place["prior"], kPosition_m);
    (void)read_covariance(place["covariance"]);
    ++graph_.priors;
  }

  void read_between(const FactorPlace& at, Stamp stamp, const JsonPlace& place) {
    const JsonPlace key1 = place["key1"], key2 = place["key2"];
    JrlMeasurement measured{.edge = {.from = read_key(key1), .to = read_key(key2)}, .stamp = stamp};
    RelativePose& edge = measured.edge;
    if (edge.from == edge.to) key2.fail("is the pose of key1: " + key2.text());
    edge.T_from_to = read_pose(place["measurement"], kStep_m);
    edge.covariance = read_covariance(place["covariance"]);
    named_.push_back({edge.from, key1});
    named_.push_back({edge.to, key2});
    std::vector<std::size_t>& same_pair = by_pair_[{edge.from, edge.to}];
    const auto copy = std::find_if(same_pair.begin(), same_pair.end(), [&](std::size_t k) {
      const RelativePose& other = graph_.measurements[k].edge;
      return other.T_from_to.matrix() == edge.T_from_to.matrix() &&
             other.covariance == edge.covariance;
    });
    if (copy != same_pair.end()) {
      JrlMeasurement& first = graph_.measurements[*copy];
      first.stamp = std::min(first.stamp, stamp);
      number_of_.emplace(at, *copy);
      ++graph_.repeated;
      return;
    }
    same_pair.push_back(graph_.measurements.size());
    number_of_.emplace(at, graph_.measurements.size());
    graph_.measurements.push_back(std::move(measured));
  }

  // The poses of a robot are index 0 and all indices that steps of odometry reach from it.
  void find_chains(const JsonPlace& place) {
    std::map<KeyframeId, Stamp> known_from;  // by keyframe: time of the odometry that ends on it
    for (const JrlMeasurement& measured : graph_.measurements) {
      const auto& [from, to] = std::pair(measured.edge.from, measured.edge.to);
      if (from.robot == to.robot && to.index == std::uint64_t{from.index} + 1)
        known_from.emplace(to, measured.stamp);
    }
    for (const RobotId robot : robots_) {
      const auto first = first_stamp_.find(robot);
      if (first == first_stamp_.end()) place.fail("has no entry of robot " + std::to_string(robot));
      std::vector<Stamp>& stamps = graph_.stamps[robot];
      stamps.push_back(first->second);
      for (KeyframeIndex next = 1; known_from.contains({robot, next}); ++next) {
        const Stamp stamp = known_from.at({robot, next});
        if (stamp <= stamps.back())
          place.fail("the odometry that ends on " + to_string({robot, next}) + " has the stamp " +
                     std::to_string(stamp) + ", not later than the pose before, " +
                     std::to_string(stamps.back()));
        stamps.push_back(stamp);
      }
    }
  }

  void check_keys() const {
    for (const Named& named : named_) {
      if (named.id.index >= graph_.stamps.at(named.id.robot).size())
        named.place.fail(named.place.text() + " (" + to_string(named.id) +
                         ") is a pose that no odometry from index 0 reaches");
    }
  }

  void read_values(const JsonPlace& place, std::map<KeyframeId, SE3>& poses) const {
    for (const auto& [robot, values] : by_robot(place)) {
      std::set<KeyframeId> in_list;
      for (const auto& [id, value] : keyed_values(values)) {
        if (!in_list.insert(id).second) value.fail("is a second pose of " + to_string(id));
        const SE3 T_world_kf = read_pose(value, kPosition_m);
        if (id.robot == robot)
          poses.insert_or_assign(id, T_world_kf);
        else
          poses.emplace(id, T_world_kf);
      }
    }
  }

  // Reads [{"key": key, ...}, ...] or {"key": {...}, ...}.
  [[nodiscard]] std::vector<std::pair<KeyframeId, JsonPlace>> keyed_values(
      const JsonPlace& place) const {
    std::vector<std::pair<KeyframeId, JsonPlace>> values;
    if (!place.is_map()) {
      for (const JsonPlace& value : place.list())
        values.emplace_back(read_key(value["key"]), value);
      return values;
    }
    for (const auto& [name, value] : place.members()) {
      std::uint64_t key = 0;
      const auto [end, error] = std::from_chars(name.data(), name.data() + name.size(), key);
      if (error != std::errc() || end != name.data() + name.size())
        value.fail("is not of a key: \"" + name + '"');
      values.emplace_back(keyframe_of(key, value), value);
    }
    return values;
  }

  void read_labels(const JsonPlace& document) {
    if (const auto labels = document.find("outlier_factors")) {
      graph_.has_labels = true;
      for (const std::size_t k : labelled(*labels)) graph_.measurements[k].is_false = true;
    }
  }

  // Indices in graph_.measurements of labelled measurements. `labels` is {"a": [[i, j], ...], ...}:
  // measurement j in entry i of the list of robot a. With a single robot `labels` may be the list
  // alone.
  [[nodiscard]] std::vector<std::size_t> labelled(const JsonPlace& labels) const {
    std::vector<std::size_t> numbers;
    const bool of_one_robot = labels.is_list() && robots_.size() == 1;
    for (const auto& [robot, list] :
         of_one_robot ? ByRobot{{*robots_.begin(), labels}} : by_robot(labels))
      for (const JsonPlace& label : list.list()) {
        const auto [entry, measurement] = label.pair();
        constexpr std::uint64_t kMost = std::numeric_limits<std::uint32_t>::max();
        const auto number =
            number_of_.find({robot, entry.integer(kMost), measurement.integer(kMost)});
        if (number == number_of_.end())
          label.fail("names no BetweenFactorPose3: entry " + entry.text() + ", measurement " +
                     measurement.text());
        numbers.push_back(number->second);
      }
    return numbers;
  }

  JrlGraph graph_;
  std::set<RobotId> robots_;
  std::map<RobotId, Stamp> first_stamp_;
  std::vector<Named> named_;
  std::map<std::pair<KeyframeId, KeyframeId>, std::vector<std::size_t>> by_pair_;
  std::map<FactorPlace, std::size_t>
      number_of_;  // by place in the document: index in graph_.measurements
};

}  // namespace

JrlGraph parse_jrl(const std::string& text, const std::string& file) {
  nlohmann::json document;
  try {
    document = nlohmann::json::parse(text);
  } catch (const nlohmann::json::exception& error) {
    throw std::runtime_error(file + ": " + readable(error.what()));
  }
  return JrlReader().read(JsonPlace(document, "", file));
}

JrlGraph read_jrl(const std::filesystem::path& file) {
  return parse_jrl(read_input_file(file), file.string());
}

RecordedGraph part_of(const JrlGraph& graph, RobotId robot, const std::string& file) {
  if (!std::binary_search(graph.robots.begin(), graph.robots.end(), robot)) {
    std::string robots;
    for (const RobotId other : graph.robots) robots += ' ' + std::to_string(other);
    throw std::runtime_error(file + ": has no robot " + std::to_string(robot) + ", but" + robots);
  }
  std::vector<RelativePose> edges;
  for (const JrlMeasurement& measured : graph.measurements)
    if (measured.edge.from.robot == robot || measured.edge.to.robot == robot)
      edges.push_back(measured.edge);
  RecordedGraph part = make_recorded_graph(edges, file);
  part.stamps = graph.stamps.at(robot);
  return part;
}

}  // namespace km
