#include "apps/pgo/pgo_robust.hpp"

#include <algorithm>
#include <ostream>
#include <sstream>

#include "apps/team/text_table.hpp"
#include "modules/core/json_writer.hpp"
#include "modules/pose_graph/robust/staged_gnc_team.hpp"

namespace km {
namespace {

// Kept ones of those edges that `counts` holds for.
std::string kept_of(const RobustRun& run, const auto& counts) {
  std::size_t kept = 0, all = 0;
  for (std::size_t k = 0; k < run.kept.size(); ++k) {
    if (!counts(k)) continue;
    ++all;
    if (run.kept[k]) ++kept;
  }
  return std::to_string(kept) + " of " + std::to_string(all);
}

std::string noise_text(const RobustRun& run) {
  if (!run.noise) return {};
  return "closures are " + fixed(run.noise->scale, 3) + " times as noisy as the graph says, by " +
         std::to_string(run.noise->pairs) + " pairs of them, " +
         fixed(100.0 * run.noise->consistent, 0) + " % consistent\n";
}

}  // namespace

RobustRun run_robust(const TeamGraph& graph, GncAgentOptions options, NoiseModel noise,
                     int max_rounds, const TeamMeter& meter) {
  RobustRun run;
  run.odometry = odometry_edges(graph);
  run.barc = options.gnc.barc > 0.0 ? options.gnc.barc : default_barc(graph.dimension);
  if (noise != NoiseModel::kNominal) run.noise = noise_scale(graph, run.odometry);
  if (run.noise)
    run.scale = noise == NoiseModel::kLarger ? std::max(1.0, run.noise->scale) : run.noise->scale;
  options.gnc.barc = run.barc * run.scale;
  StagedGncTeam team(graph, 3, options);
  // The team ends by itself: that there is no gradient says nothing of the weights.
  run.rounds = run_team(graph, team, {.max_rounds = max_rounds, .gradient_tolerance = -1.0}, meter);
  run.kept = team.kept();
  run.updates = team.updates();
  run.isolated = team.isolated();
  run.decided = team.done();
  for (std::size_t k = 0; k < graph.robots(); ++k)
    for (const SE3& T : team.agent(k).poses()) run.T_world_kf.push_back(T);
  return run;
}

std::string robust_text(const TeamGraph& graph, const RobustRun& run) {
  const auto between = [&](std::size_t k) {
    return graph.robot_of(graph.edges[k].i) != graph.robot_of(graph.edges[k].j);
  };
  const TeamWork& work = run.rounds.back().work;
  std::ostringstream text;
  text << "gnc: " << graph.poses() << " poses, " << graph.edges.size() << " edges, "
       << graph.robots() << (graph.robots() == 1 ? " robot\n" : " robots\n") << "kept "
       << kept_of(run, [&](std::size_t k) { return !run.odometry[k] && between(k); })
       << " closures between robots, "
       << kept_of(run, [&](std::size_t k) { return !run.odometry[k] && !between(k); })
       << " inside a robot, "
       << kept_of(run, [&](std::size_t k) { return static_cast<bool>(run.odometry[k]); })
       << " steps of odometry\n"
       << "threshold " << fixed(run.barc * run.scale, 2) << " sigma of the graph\n"
       << noise_text(run) << run.updates << " updates of the weights in " << run.rounds.size() - 1
       << " rounds, " << bytes_text(static_cast<double>(work.bytes)) << " sent, critical path "
       << fixed(work.critical_path_s, 3) << " s, CPU " << fixed(work.total_cpu_s, 3) << " s\n";
  if (run.isolated > 0)
    text << run.isolated << " closures have none beside them that agrees: heard in the end only\n";
  if (!run.decided) text << "not decided: --rounds did not suffice\n";
  return text.str();
}

void write_robust_json(std::ostream& out, const TeamGraph& graph, const RobustRun& run) {
  JsonWriter json(out);
  json.begin_object();
  json.field("poses", graph.poses());
  json.field("edges", graph.edges.size());
  json.field("robots", graph.robots());
  json.field("robust", "gnc");
  json.field("barc", run.barc);
  json.field("scale", run.scale);
  json.field("updates", run.updates);
  json.field("isolated", run.isolated);
  json.field("decided", run.decided);
  std::vector<std::size_t> kept;
  for (std::size_t k = 0; k < run.kept.size(); ++k)
    if (run.kept[k]) kept.push_back(k);
  json.array("kept", kept);
  json.key("rounds");
  json.begin_array();
  for (const TeamRound& round : run.rounds) {
    json.begin_object();
    json.field("bytes", round.work.bytes);
    json.field("critical_path_s", round.work.critical_path_s);
    json.field("total_cpu_s", round.work.total_cpu_s);
    json.end_object();
  }
  json.end_array();
  json.end_object();
}

}  // namespace km
