#include <algorithm>
#include <iostream>
#include <memory>
#include <numeric>

#include "apps/lab/crowd/commands.hpp"
#include "apps/lab/crowd/crowd_graph.hpp"
#include "apps/lab/pgo/solvers.hpp"
#include "apps/lab/pgo_study/agent_team.hpp"
#include "modules/core/text_table.hpp"
#include "modules/pose_graph/team_message_bytes.hpp"

namespace km {
namespace {

struct BackEndCommand {
  CrowdGraphOptions graph = {};
  std::vector<std::size_t> robots = {10, 30, 60};
  AgentTeamOptions team = {};
};

void define(Command app, BackEndCommand& command) {
  CrowdGraphOptions& graph = command.graph;
  app.add_option("--robots", command.robots, "Sizes of the team").delimiter(',').show_default();
  app.add_option("--keyframes", graph.keyframes, "Keyframes of a robot").show_default();
  app.add_option("--partners", graph.partners, "Robots that each robot meets, even").show_default();
  app.add_option("--closures", graph.closures, "Closures between two such robots").show_default();
  app.add_option("--seed", graph.seed, "Seed of the noise").show_default();
  app.add_option("--rate", command.team.keyframes_per_s,
                 "Keyframes per second at which robots play their graphs; 0: all at once")
      .show_default();
  app.add_option("--longest", command.team.longest_s, "Limit of the virtual time [s]")
      .show_default();
}

double mean_received(const AgentTeamRun& run, TeamMessageKind kind) {
  double sum = 0.0;
  for (const AgentCost& cost : run.costs)
    sum += static_cast<double>(cost.received[static_cast<std::size_t>(kind)]);
  return sum / static_cast<double>(run.costs.size());
}

std::size_t sum_of(const std::array<std::size_t, 4>& bytes) {
  return std::accumulate(bytes.begin(), bytes.end(), std::size_t{0});
}

std::vector<std::string> row_of(std::size_t robots, const AgentTeamRun& run) {
  double received = 0.0;
  double cpu_s = 0.0;
  double most_cpu_s = 0.0;
  std::size_t most_sent = 0;
  std::size_t most_received = 0;
  for (const AgentCost& cost : run.costs) {
    received += static_cast<double>(sum_of(cost.received)) / static_cast<double>(robots);
    cpu_s += cost.cpu_s / static_cast<double>(robots);
    most_cpu_s = std::max(most_cpu_s, cost.cpu_s);
    most_sent = std::max(most_sent, sum_of(cost.sent));
    most_received = std::max(most_received, sum_of(cost.received));
  }
  const auto joined = std::ranges::count(run.world_of, run.world_of.front());
  const auto kind = [&](TeamMessageKind one) { return bytes_text(mean_received(run, one)); };
  return {std::to_string(robots),
          std::to_string(joined),
          std::to_string(std::ranges::count(run.kept, false)),
          std::to_string(run.sessions),
          std::to_string(run.rounds),
          fixed(run.seconds, 0),
          bytes_text(received),
          kind(TeamMessageKind::kStatus),
          kind(TeamMessageKind::kSession),
          kind(TeamMessageKind::kMemberPoses),
          kind(TeamMessageKind::kReliable),
          bytes_text(static_cast<double>(most_sent)),
          bytes_text(static_cast<double>(most_received)),
          fixed(cpu_s, 2),
          fixed(most_cpu_s, 2)};
}

void run(BackEndCommand& command) {
  command.team.meter.cpu_s = thread_cpu_s;
  std::vector<std::vector<std::string>> table{
      {"robots", "joined", "lost", "sessions", "rounds", "end [s]", "received", "statuses",
       "sessions'", "poses", "solver", "most sent", "most received", "CPU [s]", "most CPU [s]"}};
  for (const std::size_t robots : command.robots) {
    std::cerr << "team of " << robots << " robots ...\n";
    command.graph.robots = robots;
    table.push_back(row_of(robots, run_agent_team(crowd_graph(command.graph), command.team)));
  }
  std::cout << "Of one robot, the mean unless said; content of messages, once per receiver. Lost: "
               "closures of the team, all true, that are rejected\n"
            << align_columns(table);
}

}  // namespace

void add_back_end_study(Command parent) {
  const Command app = parent.add_subcommand(
      "back-end", "Sessions of the robots' own back-end: bytes and processor time of a robot");
  const auto command = std::make_shared<BackEndCommand>();
  define(app, *command);
  app.callback([command] { run(*command); });
}

}  // namespace km
