#include "apps/team/report_page.hpp"

#include <algorithm>
#include <cmath>
#include <exception>
#include <initializer_list>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <ostream>
#include <span>
#include <stdexcept>
#include <string_view>
#include <utility>

#include "apps/evaluate/mesh_picture.hpp"
#include "apps/output_file.hpp"
#include "apps/team/closure_images.hpp"
#include "apps/team/team_report.hpp"
#include "modules/charts/html_page.hpp"
#include "modules/core/io/input_file.hpp"
#include "modules/core/io/text_rows.hpp"
#include "modules/images/image_codec.hpp"

namespace km {

// report.js and report.css, see CMakeLists.txt.
[[nodiscard]] std::span<const PageFile> report_files();

namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostPoints = 1500;  // per series; a page is no wider

// Every k-th element, and the last one.
template <typename T>
std::vector<T> thinned(std::vector<T> all) {
  const std::size_t stride = all.size() / kMostPoints + 1;
  if (stride == 1) return all;
  std::vector<T> kept;
  for (std::size_t i = 0; i < all.size(); i += stride) kept.push_back(std::move(all[i]));
  if ((all.size() - 1) % stride != 0) kept.push_back(std::move(all.back()));
  return kept;
}

// Millimetres and milliseconds are enough for a page.
double in_thousandths(double value) {
  return std::round(value * 1e3) / 1e3;
}

Stamp first_stamp(const RobotPaths& paths) {
  Stamp first = std::numeric_limits<Stamp>::max();
  for (const auto* path : {&paths.odometry, &paths.optimized})
    if (!path->empty()) first = std::min(first, path->front().stamp);
  return first;
}

// Makes a point of each item, and a point of nulls in each hole, which interrupts the line.
template <typename Item, typename PointOf>
Json broken_line(std::vector<Item> items, const std::vector<PoseHole>& holes, PointOf point_of) {
  Json points = Json::array();
  auto hole = holes.begin();
  for (const Item& item : thinned(std::move(items))) {
    const auto open = hole;
    while (hole != holes.end() && item.stamp >= hole->to) ++hole;
    if (hole != open && !points.empty()) points.push_back(Json::array_t(points.back().size()));
    points.push_back(point_of(item));
  }
  return points;
}

Json from_above(const std::vector<StampedPose>& path, const std::vector<PoseHole>& holes,
                Stamp first) {
  return broken_line(path, holes, [first](const StampedPose& pose) -> Json {
    return {in_thousandths(pose.T.translation().x()), in_thousandths(pose.T.translation().y()),
            in_thousandths(seconds_between(first, pose.stamp))};
  });
}

// Position error over time, at the poses that trajectory_error() compares.
Json position_error(const RobotPaths& paths, const std::vector<StampedPose>& estimate,
                    const std::vector<PoseHole>& holes, Stamp first) {
  if (paths.truth.empty() || estimate.empty()) return Json::array();
  const TimeWindow window{paths.truth.front().stamp, paths.truth.back().stamp};
  return broken_line(
      associate(paths.truth, estimate, window), holes, [first](const PosePair& pair) -> Json {
        return {in_thousandths(seconds_between(first, pair.stamp)),
                (pair.T_truth_body.translation() - pair.T_estimate_body.translation()).norm()};
      });
}

// Positions of the robot at its keyframes; keyframes without a known pose are left out.
Json keyframes_from_above(const RobotResult& robot) {
  constexpr double kMaxGap_s = 0.5;
  Json points = Json::array();
  for (const KeyframeRecord& keyframe : robot.keyframes) {
    const auto T = pose_at(robot.paths.optimized, keyframe.stamp, kMaxGap_s, kMaxGap_s);
    if (T)
      points.push_back({keyframe.id.index, in_thousandths(T->translation().x()),
                        in_thousandths(T->translation().y())});
  }
  return points;
}

// Numbers the reasons, because there are few reasons for many closures.
class Reasons {
 public:
  std::size_t number(const std::string& reason) {
    const auto [known, is_new] = numbers_.try_emplace(reason, numbers_.size());
    if (is_new) texts_.push_back(reason);
    return known->second;
  }
  [[nodiscard]] const std::vector<std::string>& texts() const { return texts_; }

 private:
  std::map<std::string, std::size_t> numbers_;
  std::vector<std::string> texts_;
};

Json closures_of(const RobotResult& robot, Reasons& reasons) {
  Json rows = Json::array();
  for (const ClosureRecord& closure : robot.closures)
    rows.push_back({closure.id.from.robot, closure.id.from.index, closure.id.to.robot,
                    closure.id.to.index, static_cast<int>(closure.stage), closure.matches,
                    closure.inliers, reasons.number(closure.reason)});
  return rows;
}

// Rows of a table of numbers among the results of a robot, without the names of the columns.
class TableRows {
 public:
  explicit TableRows(const fs::path& file)
      : file_(file), text_(read_input_file(file)), rows_(split_rows(text_)) {
    if (!rows_.empty()) rows_.erase(rows_.begin());
  }

  [[nodiscard]] const std::vector<TextRow>& all() const { return rows_; }

  // Throws std::runtime_error that names the file and the line.
  [[nodiscard]] double number(const TextRow& row, std::size_t i) const {
    const auto value = number_in(row, i);
    if (!value || !std::isfinite(*value))
      throw std::runtime_error(file_.string() + " line " + std::to_string(row.line) + ": field " +
                               std::to_string(i + 1) + " is not a number");
    return *value;
  }
  // These columns of all rows.
  [[nodiscard]] std::vector<Json> numbers(std::initializer_list<std::size_t> columns) const {
    std::vector<Json> result;
    for (const TextRow& row : rows_) {
      Json& values = result.emplace_back();
      for (const std::size_t i : columns) values.push_back(number(row, i));
    }
    return result;
  }

 private:
  const fs::path file_;
  const std::string text_;
  std::vector<TextRow> rows_;
};

// Round and cost.
Json rounds_of(const fs::path& file) {
  return thinned(TableRows(file).numbers({1, 3}));
}

Json process_of(const fs::path& file) {
  return thinned(TableRows(file).numbers({0, 1, 2}));
}

Json timing_of(const fs::path& file) {
  const TableRows table(file);
  Json rows = Json::array();
  for (const TextRow& row : table.all()) {
    Json& values = rows.emplace_back(Json::array({row.fields.front()}));
    for (const std::size_t i : {1, 2, 3, 4, 5}) values.push_back(table.number(row, i));
  }
  return rows;
}

// Bytes sent until each time of the table, with retransmissions, by category.
Json sent_of(const fs::path& file) {
  struct SentBytes {
    double time_s = 0.0;
    std::map<std::string, double> by_category;
  };
  const TableRows table(file);
  std::vector<SentBytes> all;
  std::map<std::pair<std::string_view, std::string_view>, double> known;  // by topic and peer
  for (const TextRow& row : table.all()) {
    const double time_s = table.number(row, 0), bytes = table.number(row, 6) + table.number(row, 7);
    if (all.empty() || all.back().time_s < time_s)
      all.push_back(
          {time_s, all.empty() ? std::map<std::string, double>() : all.back().by_category});
    if (row.fields[1] == "out")
      all.back().by_category[std::string(row.fields[3])] +=
          bytes - std::exchange(known[{row.fields[2], row.fields[4]}], bytes);
  }
  Json sent = Json::object();
  for (const SentBytes& until : thinned(std::move(all)))
    for (const auto& [category, bytes] : until.by_category)
      sent[category].push_back({until.time_s, bytes});
  return sent;
}

// A missing table is no fault: the robot did not run that part.
Json table(const fs::path& file, Json (*read)(const fs::path&), Json& notes) try {
  return is_there(file) ? read(file) : Json::array();
} catch (const std::exception& error) {
  notes.push_back(error.what());
  return Json::array();
}

}  // namespace

// The map of the team as JPEG, seen from above at an angle; empty without a map.
std::string map_picture(const LabelledMesh& map) {
  if (map.faces.empty()) return {};
  const PictureView view = parse_view("oblique", extent_of(map), 1000, 560);
  const cv::Mat3b picture =
      draw_meshes({.meshes = {&map, 1}, .names = {""}, .lines = {}, .palette = {}}, view,
                  map.colors.empty() ? PictureColor::kShade : PictureColor::kOwn);
  constexpr int kQuality = 85;
  const std::vector<std::uint8_t> bytes = encode_jpeg(picture, kQuality);
  return data_uri("image/jpeg", {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

Json report_data(const TeamPlan& plan, const TeamResult& team) {
  Reasons reasons;
  Json notes = Json::array(), robots = Json::array();
  for (const RobotResult& robot : team.robots) {
    const fs::path folder = plan.output / robot.plan.name;
    const RobotPaths& paths = robot.paths;
    const Stamp first = first_stamp(paths);
    const std::vector<PoseHole> holes =
        pose_holes(paths.odometry);  // odometry has more poses than keyframes
    robots.push_back({{"id", robot.plan.id},
                      {"name", robot.plan.name},
                      {"truth", from_above(paths.truth, pose_holes(paths.truth), first)},
                      {"odometry", from_above(paths.odometry, holes, first)},
                      {"optimized", from_above(paths.optimized, holes, first)},
                      {"odometry_error", position_error(paths, paths.odometry, holes, first)},
                      {"optimized_error", position_error(paths, paths.optimized, holes, first)},
                      {"keyframes", keyframes_from_above(robot)},
                      {"closures", closures_of(robot, reasons)},
                      {"rounds", table(folder / "optimizer.csv", rounds_of, notes)},
                      {"sent", table(folder / "traffic.csv", sent_of, notes)},
                      {"process", table(folder / "process.csv", process_of, notes)},
                      {"timing", table(folder / "timing.csv", timing_of, notes)}});
  }
  ClosureImages seen = closure_images(team.robots);
  Json images = Json::object();
  for (const auto& [keyframe, jpeg] : seen.jpegs)
    images[to_string(keyframe)] = data_uri("image/jpeg", jpeg);
  for (std::string& note : seen.notes) notes.push_back(std::move(note));
  return {{"folder", plan.output.string()},
          {"team", team},
          {"reasons", reasons.texts()},
          {"notes", std::move(notes)},
          {"images", std::move(images)},
          {"robots", std::move(robots)},
          {"map", map_picture(team.meshes.merged)}};
}

std::string report_page(const Json& data) {
  const std::span<const PageFile> shared = chart_files(), own = report_files();
  return html_page(
      {.title = "Report of a run",
       .styles = {page_file(shared, "theme.css"), page_file(shared, "document.css"),
                  page_file(own, "report.css")},
       .body = "<main></main>\n" + data_script("run", data) +
               module_script({page_file(shared, "charts.js"), page_file(own, "report.js")})});
}

void write_report(const fs::path& file, const TeamPlan& plan, const TeamResult& team) {
  write_output(file, [&](std::ostream& out) { out << report_page(report_data(plan, team)); });
}

}  // namespace km
