#include "apps/pgo/pgo_robust.hpp"

#include <ostream>
#include <sstream>

#include "apps/team/text_table.hpp"
#include "modules/core/json_writer.hpp"
#include "modules/pose_graph/robust/staged_gnc_team.hpp"

namespace km {
namespace {

struct Count {
  std::size_t kept = 0, all = 0;
};

// Those of the edges that `counts` holds for.
Count count_of(const RobustRun& run, const auto& counts) {
  Count count;
  for (std::size_t k = 0; k < run.kept.size(); ++k) {
    if (!counts(k)) continue;
    ++count.all;
    if (run.kept[k]) ++count.kept;
  }
  return count;
}

std::string text_of(const Count& count) {
  return std::to_string(count.kept) + " of " + std::to_string(count.all);
}

std::string noise_text(const RobustRun& run) {
  if (!run.noise.estimate) return {};
  const NoiseScale& noise = *run.noise.estimate;
  return "closures are " + fixed(noise.scale, 3) + " times as noisy as the graph says, by " +
         std::to_string(noise.pairs) + " pairs of them, " + fixed(100.0 * noise.consistent, 0) +
         " % consistent\n";
}

std::string hint_text(const RobustRun& run) {
  const Count closures = count_of(run, [&](std::size_t k) { return !run.odometry[k]; });
  const std::size_t rejected = closures.all - closures.kept;
  if (!run.noise_model.nominal() || 10 * rejected <= closures.all) return {};
  return std::to_string(rejected) + " of " + std::to_string(closures.all) +
         " closures rejected, more than a tenth: they are false, or noisier than the graph says; "
         "--noise-scale larger tells\n";
}

}  // namespace

RobustRun run_robust(const TeamGraph& graph, GncAgentOptions options, const NoiseModel& noise,
                     int max_rounds, const TeamMeter& meter) {
  RobustRun run;
  run.odometry = odometry_edges(graph);
  run.barc = options.gnc.barc > 0.0 ? options.gnc.barc : default_barc(graph.dimension);
  run.noise_model = noise;
  run.noise = closure_noise(graph, run.odometry, noise);
  options.gnc.barc = run.barc * run.noise.scale;
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
       << text_of(count_of(run, [&](std::size_t k) { return !run.odometry[k] && between(k); }))
       << " closures between robots, "
       << text_of(count_of(run, [&](std::size_t k) { return !run.odometry[k] && !between(k); }))
       << " inside a robot, "
       << text_of(count_of(run, [&](std::size_t k) { return static_cast<bool>(run.odometry[k]); }))
       << " steps of odometry\n"
       << "threshold " << fixed(run.barc * run.noise.scale, 2) << " sigma of the graph\n"
       << noise_text(run) << run.updates << " updates of the weights in " << run.rounds.size() - 1
       << " rounds, " << bytes_text(static_cast<double>(work.bytes)) << " sent, critical path "
       << fixed(work.critical_path_s, 3) << " s, CPU " << fixed(work.total_cpu_s, 3) << " s\n";
  if (run.isolated > 0)
    text << run.isolated << " closures have none beside them that agrees: heard in the end only\n";
  text << hint_text(run);
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
  json.field("scale", run.noise.scale);
  json.field("scaled_barc", run.barc * run.noise.scale);
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
