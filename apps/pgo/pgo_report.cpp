#include "apps/pgo/pgo_report.hpp"

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <ostream>
#include <sstream>

#include "apps/team/text_table.hpp"
#include "modules/core/json_writer.hpp"
#include "modules/evaluation/curve_plot.hpp"

namespace km {
namespace {

constexpr std::size_t kMostMarks = 40;  // rounds beyond which their marks would hide the line

std::string digits(double value, int precision) {
  std::ostringstream text;
  text << std::setprecision(precision) << value;
  return text.str();
}

// Relative to the optimum, or to what rounding leaves of it where there is no noise.
double gap(const PgoRun& run, const TeamRound& round) {
  constexpr double kNoCost = 1e-9;
  return (round.cost - run.optimum) / std::max(run.optimum, kNoCost);
}

// Bottom of a logarithmic axis of gaps: the decade below the least that is above 0. Once there is
// no gap left, rounding makes it 0 or less.
double gap_floor(const PgoRun& run) {
  double least = 1.0;
  for (const TeamRound& round : run.rounds)
    if (const double g = gap(run, round); g > 0.0) least = std::min(least, g);
  return std::pow(10.0, std::floor(std::log10(least)));
}

std::vector<std::string> row(const std::string& name, const PgoRun& run, std::size_t k) {
  const TeamRound& round = run.rounds[k];
  return {name,
          std::to_string(k),
          digits(round.cost, 9),
          digits(gap(run, round), 2),
          digits(round.gradient_norm, 2),
          bytes_text(static_cast<double>(round.work.bytes)),
          fixed(round.work.critical_path_s, 3),
          fixed(round.work.total_cpu_s, 3)};
}

std::string table(const PgoRun& run) {
  std::vector<std::vector<std::string>> rows{
      {"", "rounds", "cost", "gap", "gradient", "sent", "critical s", "CPU s"}};
  rows.push_back(row("start", run, 0));
  for (const double target : {1e-2, 1e-3, 1e-4, 1e-5, 1e-6}) {
    const auto reached =
        std::find_if(run.rounds.begin(), run.rounds.end(),
                     [&](const TeamRound& round) { return gap(run, round) < target; });
    const std::string name = "gap < " + digits(target, 1);
    if (reached == run.rounds.end()) {
      rows.push_back({name, "-", "", "", "", "", "", ""});
      break;
    }
    rows.push_back(row(name, run, static_cast<std::size_t>(reached - run.rounds.begin())));
  }
  rows.push_back(row("end", run, run.rounds.size() - 1));
  return align_columns(rows);
}

std::string verification_text(const TeamVerification& verification) {
  const std::string verdict = verification.negative    ? "found a direction that leads down"
                              : verification.converged ? "found no direction that leads down"
                                                       : "came to no end";
  return "the team's own verification " + verdict + " (" + std::to_string(verification.rounds) +
         " rounds, " + bytes_text(static_cast<double>(verification.work.bytes)) + ", critical " +
         fixed(verification.work.critical_path_s, 3) + " s, least curvature beyond the kernel " +
         digits(verification.lambda_min, 3) + ")\n";
}

std::string verticals_text(const TeamGraph& graph) {
  return graph.verticals.empty() ? "" : std::to_string(graph.verticals.size()) + " verticals, ";
}

}  // namespace

std::string pgo_text(const TeamGraph& graph, const PgoRun& run) {
  std::ostringstream text;
  text << to_string(run.method) << ": " << graph.poses() << " poses, " << graph.edges.size()
       << " edges, " << verticals_text(graph) << graph.robots()
       << (graph.robots() == 1 ? " robot\n" : " robots\n") << table(run) << "chordal start in "
       << fixed(run.start_s, 3) << " s, optimum " << digits(run.optimum, 9) << ", rounded cost "
       << digits(run.rounded_cost, 9) << ", rank " << run.rank << '\n';
  text << (run.certificate.certified ? "certified" : "not certified")
       << ": the cost lies above that of any poses by at most "
       << digits(std::max(run.certificate.relative_gap, 1e-12), 2) << " of itself (lambda_min "
       << digits(run.certificate.lambda_min, 3) << ")\n";
  if (run.verification) text << verification_text(*run.verification);
  return text.str();
}

void write_pgo_json(std::ostream& out, const TeamGraph& graph, const PgoRun& run) {
  JsonWriter json(out);
  json.begin_object();
  json.field("poses", graph.poses());
  json.field("edges", graph.edges.size());
  json.field("verticals", graph.verticals.size());
  json.field("robots", graph.robots());
  json.field("method", to_string(run.method));
  json.key("rounds");
  json.begin_array();
  for (const TeamRound& round : run.rounds) {
    json.begin_object();
    json.field("cost", round.cost);
    json.field("gradient_norm", round.gradient_norm);
    json.field("bytes", round.work.bytes);
    json.field("critical_path_s", round.work.critical_path_s);
    json.field("total_cpu_s", round.work.total_cpu_s);
    json.end_object();
  }
  json.end_array();
  json.field("rounded_cost", run.rounded_cost);
  json.field("lambda_min", run.certificate.lambda_min);
  json.field("certified", run.certificate.certified);
  json.field("rank", run.rank);
  json.field("optimum", run.optimum);
  json.field("start_cpu_s", run.start_s);
  json.end_object();
}

std::string pgo_plot(const PgoRun& run) {
  const double floor = gap_floor(run);
  const bool clipped = std::any_of(run.rounds.begin(), run.rounds.end(),
                                   [&](const TeamRound& round) { return gap(run, round) < floor; });
  const auto panel = [&](const char* label, const auto& abscissa) {
    CurvePanel result{.title = std::string(to_string(run.method)) + ": gap to the optimum" +
                               (clipped ? " (none: at the bottom)" : ""),
                      .x_label = label,
                      .y_label = "(F - F*) / F*",
                      .log_y = true,
                      .curves = {}};
    Curve& curve = result.curves.emplace_back();
    curve.marks = run.rounds.size() <= kMostMarks;
    for (std::size_t k = 0; k < run.rounds.size(); ++k)
      curve.points.push_back({abscissa(k), std::max(floor, gap(run, run.rounds[k]))});
    return result;
  };
  return plot_curves(std::vector{
      panel("rounds", [](std::size_t k) { return static_cast<double>(k); }),
      panel("sent by all robots [MB]",
            [&](std::size_t k) { return 1e-6 * static_cast<double>(run.rounds[k].work.bytes); }),
      panel("critical path [s of CPU time]",
            [&](std::size_t k) { return run.rounds[k].work.critical_path_s; })});
}

}  // namespace km
