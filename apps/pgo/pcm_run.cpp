#include "apps/pgo/pcm_run.hpp"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "apps/pgo/cpu_time.hpp"
#include "modules/outlier_rejection/cycle_test.hpp"
#include "modules/outlier_rejection/max_clique.hpp"
#include "modules/outlier_rejection/pcm.hpp"

namespace km {
namespace {

// The clique search of one run and what it is asked to note.
class Additions {
 public:
  explicit Additions(const PcmConfig& config)
      : clique_(static_cast<std::uint64_t>(config.max_search_nodes), config.search) {
    run.search = to_string(config.search);
  }

  PcmAddition& add(const std::vector<std::size_t>& neighbours, double check_s) {
    const double begin_s = thread_cpu_s();
    clique_.add(neighbours);
    const double search_s = thread_cpu_s() - begin_s;
    run.edges += neighbours.size();
    run.search_nodes = clique_.search_nodes();
    run.searches_ended = clique_.searches_ended();
    return run.additions.emplace_back(PcmAddition{.vertices = clique_.size(),
                                                  .check_s = check_s,
                                                  .search_s = search_s,
                                                  .clique = clique_.clique().size(),
                                                  .bound = clique_.bound()});
  }

  [[nodiscard]] std::span<const std::size_t> clique() const { return clique_.clique(); }

  PcmRun run;

 private:
  MaxClique clique_;
};

}  // namespace

PcmRun run_pcm(const std::vector<LabelledClosure>& closures, const PcmConfig& config,
               const PcmProgress& progress) {
  const CycleTest test(config);
  Additions additions(config);
  std::vector<PreparedClosure> vertices;
  std::vector<bool> is_true;
  for (std::size_t n = 0; n < closures.size(); ++n) {
    if (progress) progress(n);
    const auto& [closure, outlier] = closures[n];
    if (!is_usable(closure))
      throw std::invalid_argument("closure " + to_string(closure.from.id) + " -> " +
                                  to_string(closure.to.id) + " cannot be weighed");
    const double begin_s = thread_cpu_s();
    const OrientedClosure oriented = test.orient(closure);
    if (config.odometry_gate && !test.agrees_with_odometry(oriented)) {
      ++(outlier ? additions.run.dropped_false : additions.run.dropped_true);
      continue;
    }
    PreparedClosure added(oriented);
    const std::vector<std::size_t> consistent = test.consistent_with(added, vertices);
    vertices.push_back(std::move(added));
    is_true.push_back(!outlier);
    PcmAddition& addition = additions.add(consistent, thread_cpu_s() - begin_s);
    const auto members = additions.clique();
    addition.true_members = static_cast<std::size_t>(
        std::count_if(members.begin(), members.end(), [&](std::size_t v) { return is_true[v]; }));
    addition.true_vertices =
        static_cast<std::size_t>(std::count(is_true.begin(), is_true.end(), true));
  }
  return std::move(additions.run);
}

PcmRun run_pcm(const ConsistencyRows& rows, const PcmConfig& config, const PcmProgress& progress) {
  Additions additions(checked(config));
  for (std::size_t n = 0; n < rows.size(); ++n) {
    if (progress) progress(n);
    additions.add(rows[n], 0.0);
  }
  return std::move(additions.run);
}

std::string to_string(CliqueMethod method) {
  return method == CliqueMethod::kExact         ? "exact"
         : method == CliqueMethod::kIncremental ? "incremental"
                                                : "batch";
}

}  // namespace km
