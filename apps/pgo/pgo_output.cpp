#include "apps/pgo/pgo_output.hpp"

#include <cmath>
#include <fstream>
#include <limits>
#include <stdexcept>

#include "modules/core/precision.hpp"
#include "modules/pose_graph/g2o_io.hpp"

namespace km {
namespace {

void write_tum(const std::filesystem::path& file, const std::vector<SE3>& T_world_kf) {
  std::ofstream out(file);
  out.precision(std::numeric_limits<double>::max_digits10);
  for (std::size_t i = 0; i < T_world_kf.size(); ++i) {
    out << i;
    for (const double c : T_world_kf[i].translation()) out << ' ' << c;
    const Eigen::Quaterniond q(T_world_kf[i].linear());
    for (const double c : q.coeffs()) out << ' ' << c;
    out << '\n';
  }
  out.close();
  if (!out) throw std::runtime_error(file.string() + ": cannot be written");
}

}  // namespace

void check_output_name(const std::filesystem::path& file) {
  if (file.extension() != ".tum" && file.extension() != ".g2o")
    throw std::runtime_error(file.string() + ": --output writes *.tum or *.g2o");
}

void write_poses(const std::filesystem::path& file, const TeamGraph& graph,
                 const std::vector<SE3>& T_world_kf) {
  check_output_name(file);
  if (file.extension() == ".tum") return write_tum(file, T_world_kf);
  G2oGraph result{.dimension = 3, .vertices = {}, .edges = {}};
  for (std::size_t i = 0; i < T_world_kf.size(); ++i)
    result.vertices.push_back({graph.ids[i], T_world_kf[i]});
  for (const BlockEdge& e : graph.edges)
    result.edges.push_back({graph.ids[static_cast<std::size_t>(e.i)],
                            graph.ids[static_cast<std::size_t>(e.j)], e.T_i_j,
                            covariance_of({e.kappa, e.tau})});
  for (const VerticalPrior& v : graph.verticals)
    result.verticals.push_back(
        {graph.ids[static_cast<std::size_t>(v.pose)], {v.up, 1.0 / std::sqrt(v.weight)}});
  write_g2o(file, result);
}

}  // namespace km
