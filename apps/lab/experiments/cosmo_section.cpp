#include <algorithm>
#include <nlohmann/json.hpp>

#include "apps/lab/experiments/paper_results.hpp"
#include "apps/lab/experiments/report.hpp"
#include "modules/core/json.hpp"
#include "modules/core/text_table.hpp"

namespace km {
namespace {

constexpr int kDecimals = 2;

// Number of closures inside robots or between them, as "30 of 714".
std::string part_text(const Json& root, const std::string& place, const char* part,
                      const char* other) {
  const auto count = [&](const char* name) {
    return number_at(root, ("/closures/" + place + '/' + name).c_str()).value_or(0.0);
  };
  return fixed(count(part), 0) + " of " + fixed(count(part) + count(other), 0);
}

std::string published_text(const std::vector<double>& errors_m) {
  std::string text;
  for (const double error_m : errors_m)
    text += (text.empty() ? "" : ", ") + fixed(error_m, error_m < 100.0 ? kDecimals : 0);
  return text.empty() ? "-" : text;
}

std::vector<ReportCell> row_of(const CosmoSet& set, const Json& root,
                               const PublishedTeamErrors* published) {
  const Json rounds = root.value("rounds", Json::array());
  const auto of_last = [&](const char* key) {
    return rounds.empty() ? std::nullopt : number_at(rounds.back(), key);
  };
  return {{set.title},
          {number_text(number_at(root, "/poses"), 0)},
          {part_text(root, "inside", "true_lost", "true_kept")},
          {part_text(root, "between", "true_lost", "true_kept")},
          {part_text(root, "inside", "false_kept", "false_rejected")},
          {part_text(root, "between", "false_kept", "false_rejected")},
          {number_text(number_at(root, "/ate/team_m"), kDecimals)},
          {number_text(number_at(root, "/optimum_of_true/team_m"), kDecimals)},
          {number_text(number_at(root, "/ate_ratio"), kDecimals)},
          {published == nullptr ? "-" : published_text(published->irls_gnc_m)},
          {published == nullptr ? "-" : published_text(published->gtsam_gnc_m)},
          {number_text(of_last("/round"), 0)},
          {number_text(of_last("/critical_path_s"), 3)}};
}

// Target: the error is not larger than the smallest published one.
void add_target(const CosmoSet& set, const Json& root, const PublishedTeamErrors& published,
                ReportInput& input) {
  std::vector<double> errors_m = published.irls_gnc_m;
  errors_m.insert(errors_m.end(), published.gtsam_gnc_m.begin(), published.gtsam_gnc_m.end());
  const auto ate_m = number_at(root, "/ate/team_m");
  if (!ate_m || errors_m.empty()) return;
  const double best_m = *std::min_element(errors_m.begin(), errors_m.end());
  constexpr double kRounding_m = 0.005;  // rounding of the published values
  input.add_target({"ATE on COSMO-Bench", set.title,
                    "at most " + fixed(best_m, kDecimals) + " m, the best published",
                    fixed(*ate_m, kDecimals) + " m", *ate_m < best_m + kRounding_m});
}

}  // namespace

std::optional<ReportSection> cosmo_section(ReportInput& input) {
  ReportTable table{
      .caption = "COSMO-Bench: closures and ATE of all robots in one frame",
      .groups = {{"", 2},
                 {"true closures lost", 2},
                 {"false closures kept", 2},
                 {"ATE [m]", 3},
                 {"published ATE [m]", 2},
                 {"solve", 2}},
      .columns = {"set", "poses", "inside robots", "between robots", "inside robots",
                  "between robots", "ours", "optimum of the true closures", "ratio",
                  "IRLS-GNC variants", "GTSAM GNC-GM", "rounds", "critical path [s]"}};
  for (const CosmoSet& set : input.config().cosmo.sets) {
    const std::string step = cosmo_step_name(set);
    if (!input.has(step)) continue;
    const Json root = read_json(cosmo_file(set, input.paths()));
    const PublishedTeamErrors* const published = published_team_errors(set.stem());
    table.rows.push_back(row_of(set, root, published));
    if (published != nullptr) add_target(set, root, *published, input);
  }
  if (table.rows.empty()) return std::nullopt;
  table.note =
      "ATE: RMSE of the positions of all poses under one rigid alignment. The optimum of the true "
      "closures trusts every closure that is not labelled false. Published values: centralised, "
      "priors dropped, from chained odometry, one rigid alignment of all robots (tables of "
      "UMich-RobotExploration/variable-projection).";
  ReportSection section{.id = "cosmo", .title = "COSMO-Bench"};
  section.add(ReportParagraph{
      "Real graphs of several robots whose false closures are labelled. The team is given all of a "
      "graph at once and finds out by itself how noisy closures are and which are false; no label "
      "and no true pose is used."});
  section.add(std::move(table));
  return section;
}

}  // namespace km
