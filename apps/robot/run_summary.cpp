#include "apps/robot/run_summary.hpp"

#include <algorithm>
#include <limits>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "apps/output_file.hpp"
#include "modules/core/quantile.hpp"

namespace km {
namespace {

template <typename T>
concept VisitsFields = requires(T& record, int& visitor) {
  record.visit_fields(visitor);
};

template <typename T>
concept HasFields = VisitsFields<T> || requires(T& record, int& visitor) {
  visit_fields(record, visitor);
};

template <HasFields T>
void visit_record(T& record, auto& visitor) {
  if constexpr (VisitsFields<T>)
    record.visit_fields(visitor);
  else
    visit_fields(record, visitor);
}

class FieldWriter {
 public:
  explicit FieldWriter(Json& json) : json_(json) { json = Json::object(); }

  template <typename T>
  void field(const char* name, const std::optional<T>& value) {
    if (value) field(name, *value);
  }
  template <typename T>
  void field(const char* name, const T& value) {
    if constexpr (HasFields<T>) {
      FieldWriter part(json_[name]);
      T copy = value;
      visit_record(copy, part);
    } else {
      json_[name] = value;
    }
  }

 private:
  Json& json_;
};

class FieldReader {
 public:
  explicit FieldReader(const Json& json) : json_(json) {
    if (!json.is_object()) throw std::runtime_error("not a JSON object");
  }

  template <typename T>
  void field(const char* name, std::optional<T>& value) {
    if (json_.contains(name)) field(name, value.emplace());
  }
  template <typename T>
  void field(const char* name, T& value) try {
    const auto found = json_.find(name);
    if (found == json_.end()) return;
    if constexpr (HasFields<T>) {
      FieldReader part(*found);
      visit_record(value, part);
    } else if constexpr (std::is_floating_point_v<T>) {
      value = found->is_null() ? std::numeric_limits<T>::quiet_NaN() : found->get<T>();
    } else {
      found->get_to(value);
    }
  } catch (const std::exception& error) {
    throw std::runtime_error(std::string(name) + ": " + error.what());
  }

 private:
  const Json& json_;
};

}  // namespace

std::vector<PoseHole> pose_holes(std::span<const StampedPose> path) {
  if (path.size() < 2) return {};
  std::vector<double> intervals_s;
  intervals_s.reserve(path.size() - 1);
  for (std::size_t i = 1; i < path.size(); ++i)
    intervals_s.push_back(seconds_between(path[i - 1].stamp, path[i].stamp));
  const double longest_s =
      std::max(kHole_s, kHoleIntervals * quantile(std::move(intervals_s), 0.5));
  std::vector<PoseHole> holes;
  for (std::size_t i = 1; i < path.size(); ++i)
    if (seconds_between(path[i - 1].stamp, path[i].stamp) > longest_s)
      holes.push_back({path[i - 1].stamp, path[i].stamp});
  return holes;
}

void to_json(Json& json, const RunSummary& summary) {
  FieldWriter writer(json);
  RunSummary(summary).visit_fields(writer);
}

void write_summary(const std::filesystem::path& file, const RunSummary& summary) {
  write_output(file, [&](std::ostream& out) { out << json_text(summary); });
}

RunSummary read_summary(const std::filesystem::path& file) {
  const Json json = read_json(file);
  RunSummary summary;
  try {
    FieldReader reader(json);
    summary.visit_fields(reader);
  } catch (const std::runtime_error& error) {
    throw std::runtime_error(file.string() + ": " + error.what());
  }
  return summary;
}

}  // namespace km
