#include "apps/lab/pgo/pcm_run.hpp"

#include <algorithm>
#include <iterator>
#include <random>
#include <stdexcept>
#include <utility>
#include <variant>

#include "apps/lab/pgo/scenario.hpp"
#include "apps/lab/pgo/solvers.hpp"
#include "modules/outlier_rejection/clique_search.hpp"
#include "modules/outlier_rejection/cycle_test.hpp"
#include "modules/outlier_rejection/max_clique.hpp"
#include "modules/outlier_rejection/pcm.hpp"
#include "modules/recorded_graph/g2o_io.hpp"
#include "modules/recorded_graph/recorded_graph.hpp"

namespace km {
namespace {

// True if the closure agrees with the odometry between its ends: the cycle through it and through
// the keyframe `a` itself is consistent.
bool agrees_with_odometry(const CycleTest& test, const Closure& closure) {
  const Closure itself{.from = closure.from, .to = closure.from, .covariance = Matrix6::Zero()};
  return test.consistent(PreparedClosure(closure), PreparedClosure(itself));
}

}  // namespace

void GreedyClique::add(std::span<const std::size_t> neighbours) {
  const std::size_t added = graph_.add_vertex();
  for (const std::size_t u : neighbours) graph_.connect(u, added);
  bound_ = std::max(bound_, std::min(bound_, neighbours.size()) + 1);
  const bool from_all = starts_ == Starts::kAllVertices;
  std::size_t least = from_all ? 0 : clique_.size();
  std::vector<std::size_t> best;
  for (std::size_t v = from_all ? 0 : added; v <= added; ++v) {
    std::vector<std::size_t> clique = greedy_extension(graph_, {v}, least);
    if (clique.empty()) continue;
    least = clique.size();
    best = std::move(clique);
  }
  if (best.size() > clique_.size()) clique_ = std::move(best);
}

PcmRun run_pcm(const std::vector<LabelledClosure>& closures, const std::string& search,
               const PcmProgress& progress) {
  using enum GreedyClique::Starts;
  const CycleTest test(PcmConfig{});
  std::variant<MaxClique, GreedyClique> searched = MaxClique(MaxClique::kMaxSearchNodes);
  if (search != "exact") searched = GreedyClique(search == "batch" ? kAllVertices : kNewVertex);
  PcmRun run{.search = search, .additions = {}};
  std::vector<PreparedClosure> vertices;
  std::vector<bool> is_true;
  for (std::size_t n = 0; n < closures.size(); ++n) {
    if (progress) progress(n);
    const auto& [closure, outlier] = closures[n];
    if (!is_usable(closure))
      throw std::invalid_argument("closure " + to_string(closure.from.id) + " -> " +
                                  to_string(closure.to.id) + " cannot be weighed");
    const double begin_s = thread_cpu_s();
    const Closure oriented = test.orient(closure);
    if (!agrees_with_odometry(test, oriented)) {
      ++(outlier ? run.dropped_false : run.dropped_true);
      continue;
    }
    PreparedClosure added(oriented);
    const std::vector<std::size_t> consistent = test.consistent_with(added, vertices);
    vertices.push_back(std::move(added));
    is_true.push_back(!outlier);
    run.edges += consistent.size();
    PcmAddition& addition = run.additions.emplace_back();
    const double checked_s = thread_cpu_s();
    addition.check_s = checked_s - begin_s;
    std::visit(
        [&](auto& clique) {
          clique.add(consistent);
          addition.search_s = thread_cpu_s() - checked_s;
          addition.vertices = clique.size();
          addition.clique = clique.clique().size();
          addition.bound = clique.bound();
          for (const std::size_t v : clique.clique()) addition.true_members += is_true[v] ? 1 : 0;
        },
        searched);
    addition.true_vertices =
        static_cast<std::size_t>(std::count(is_true.begin(), is_true.end(), true));
  }
  if (const auto* exact = std::get_if<MaxClique>(&searched)) {
    run.search_nodes = exact->search_nodes();
    run.searches_ended = exact->searches_ended();
  }
  return run;
}

ClosureInput read_closures(const std::filesystem::path& file, const ClosureChoice& selection) {
  const G2oGraph g2o = read_g2o(file);
  const RecordedGraph graph = make_recorded_graph(g2o.edges, file.string());
  if (!graph.inter_closures.empty())
    throw std::runtime_error(file.string() + ": has closures between robots, must hold one robot");
  const std::vector<RelativePose>& closures = graph.intra_closures;
  if (closures.empty()) throw std::runtime_error(file.string() + ": has no loop closure");
  if (selection.keep > closures.size())
    throw std::runtime_error(file.string() + ": has " + std::to_string(closures.size()) +
                             " loop closures, " + std::to_string(selection.keep) +
                             " were asked for");

  const std::vector<OdometryPose> poses = odometry_poses(graph);
  std::vector<LabelledClosure> labelled;
  const auto add = [&](const RelativePose& edge, bool outlier) {
    labelled.push_back({{poses.at(edge.from.index), poses.at(edge.to.index), edge.T_from_to,
                         edge.covariance, 0, 0.0},
                        outlier});
  };
  std::mt19937 rng(selection.seed);
  std::vector<RelativePose> kept = closures;
  if (selection.keep > 0) {
    kept.clear();
    std::sample(closures.begin(), closures.end(), std::back_inserter(kept), selection.keep, rng);
  }
  for (const RelativePose& edge : kept) add(edge, false);
  if (selection.outliers > 0)
    for (const RelativePose& edge : random_outliers(selection.outliers,
                                                    {.robot = graph.robot,
                                                    .keyframes = graph.poses(),
                                                    .planar = g2o.dimension == 2,
                                                    .covariance = closures.front().covariance},
                                                    rng))
      add(edge, true);
  std::shuffle(labelled.begin(), labelled.end(), rng);
  return {std::move(labelled), g2o.indefinite_edges};
}

}  // namespace km
