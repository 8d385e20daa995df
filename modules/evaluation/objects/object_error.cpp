#include "modules/evaluation/objects/object_error.hpp"

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <utility>

#include "modules/evaluation/report.hpp"

namespace km {
namespace {

constexpr double kMargin_m = 0.1;

double ratio(std::size_t part, std::size_t all) {
  return all > 0 ? static_cast<double>(part) / static_cast<double>(all) : 0.0;
}

struct ObjectMatch {
  double overlap = 0.0;
  std::size_t truth = 0, estimate = 0;
};

std::vector<ObjectMatch> best_matches(std::span<const NamedObject> truth,
                                      std::span<const NamedObject> estimates, double min_overlap) {
  std::vector<ObjectMatch> pairs;
  for (std::size_t t = 0; t < truth.size(); ++t)
    for (std::size_t e = 0; e < estimates.size(); ++e) {
      if (truth[t].name != estimates[e].name) continue;
      const double overlap = intersection_over_union(truth[t].box, estimates[e].box);
      if (overlap > 0.0 && overlap >= min_overlap) pairs.push_back({overlap, t, e});
    }
  std::ranges::stable_sort(pairs, std::greater(), &ObjectMatch::overlap);
  std::vector<bool> truth_used(truth.size()), estimate_used(estimates.size());
  std::erase_if(pairs, [&](const ObjectMatch& pair) {
    if (truth_used[pair.truth] || estimate_used[pair.estimate]) return true;
    truth_used[pair.truth] = estimate_used[pair.estimate] = true;
    return false;
  });
  return pairs;
}

}  // namespace

double ObjectScore::precision() const {
  return ratio(right, estimates);
}

double ObjectScore::recall() const {
  return ratio(found, true_objects);
}

ObjectScores score_objects(std::span<const NamedObject> truth,
                           std::span<const NamedObject> estimates, const std::vector<bool>& counts,
                           double min_overlap) {
  if (counts.size() != truth.size())
    throw std::invalid_argument("objects: " + std::to_string(truth.size()) + " true ones, but " +
                                std::to_string(counts.size()) + " choices");
  std::map<std::string, ObjectScore> by_class;
  ObjectScore all{.name = "all"};
  const auto add = [&](const std::string& name, const auto& change) {
    by_class[name].name = name;
    change(by_class[name]);
    change(all);
  };
  for (std::size_t t = 0; t < truth.size(); ++t)
    if (counts[t]) add(truth[t].name, [](ObjectScore& score) { ++score.true_objects; });
  for (const NamedObject& estimate : estimates)
    add(estimate.name, [](ObjectScore& score) { ++score.estimates; });
  for (const ObjectMatch& match : best_matches(truth, estimates, min_overlap))
    add(truth[match.truth].name, [&](ObjectScore& score) {
      score.mean_overlap +=
          (match.overlap - score.mean_overlap) / static_cast<double>(++score.right);
      score.found += counts[match.truth] ? 1U : 0U;
    });
  ObjectScores scores;
  for (auto& [name, score] : by_class) scores.push_back(std::move(score));
  scores.push_back(std::move(all));
  return scores;
}

std::vector<double> mapped_surfaces_m2(const LabelledMesh& mesh,
                                       std::span<const NamedObject> objects) {
  std::vector<std::pair<Eigen::Vector3d, double>> pieces;  // centroids and areas, ascending by x
  for (const auto& [a, b, c] : mesh.faces) {
    const Eigen::Vector3f &p = mesh.vertices[a], &q = mesh.vertices[b], &r = mesh.vertices[c];
    pieces.emplace_back(((p + q + r) / 3.0F).cast<double>(), 0.5 * (q - p).cross(r - p).norm());
  }
  const auto x_of = [](const auto& piece) { return piece.first.x(); };
  std::ranges::sort(pieces, {}, x_of);
  std::vector<double> areas;
  for (const NamedObject& object : objects) {
    const ObjectBox box = object.box.grown(kMargin_m);
    const double reach = 0.5 * box.size_m.head<2>().norm();
    const double ground = object.box.center.z() - 0.5 * object.box.size_m.z() + kMargin_m;
    const SE3 T_box_world = box.pose().inverse();
    double area = 0.0;
    for (auto piece = std::ranges::lower_bound(pieces, box.center.x() - reach, {}, x_of);
         piece != pieces.end() && x_of(*piece) <= box.center.x() + reach; ++piece)
      if (piece->first.z() > ground &&
          ((T_box_world * piece->first).cwiseAbs().array() <= 0.5 * box.size_m.array()).all())
        area += piece->second;
    areas.push_back(area);
  }
  return areas;
}

std::string to_table(const ObjectScores& scores) {
  constexpr ReportColumn kColumns[] = {{"class", "/class"},
                                       {"true", "/true"},
                                       {"found", "/found"},
                                       {"recall", "/recall", 2},
                                       {"estimated", "/estimated"},
                                       {"right", "/right"},
                                       {"precision", "/precision", 2},
                                       {"IoU", "/mean_overlap", 2}};
  return report_table(to_json(scores), kColumns);
}

Json to_json(const ObjectScores& scores) {
  Json rows = Json::array();
  for (const ObjectScore& score : scores)
    rows.push_back({{"class", score.name},
                    {"true", score.true_objects},
                    {"found", score.found},
                    {"recall", score.recall()},
                    {"estimated", score.estimates},
                    {"right", score.right},
                    {"precision", score.precision()},
                    {"mean_overlap", score.mean_overlap}});
  return rows;
}

}  // namespace km
