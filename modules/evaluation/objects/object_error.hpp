#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "modules/core/io/json.hpp"
#include "modules/mesh/labelled_mesh.hpp"
#include "modules/objects/object_file.hpp"

namespace km {

/// Result for the objects of one class, or of all.
struct ObjectScore {
  std::string name;
  std::size_t true_objects = 0;  ///< Number of true objects that count.
  std::size_t found = 0;         ///< Number of these with a match.
  std::size_t estimates = 0;
  std::size_t right = 0;      ///< Number of estimates with a match.
  double mean_overlap = 0.0;  ///< Mean intersection over union of the matches; 0 without matches.

  [[nodiscard]] double precision() const;  ///< right / estimates; 0 without estimates.
  [[nodiscard]] double recall() const;     ///< found / true_objects; 0 without true objects.
};

/// Scores of each class, ascending by name, and of all objects ("all") at the end.
using ObjectScores = std::vector<ObjectScore>;

/// Matches true and estimated objects of equal class, in one frame: the pair with the largest
/// intersection over union first, each object once, down to `min_overlap`. `counts`, one per true
/// object, excludes true objects from recall (objects that the robots have not mapped); a match
/// with them still makes an estimate right. Quadratic in the number of objects. Throws
/// std::invalid_argument if `counts` has another length than `truth`.
[[nodiscard]] ObjectScores score_objects(std::span<const NamedObject> truth,
                                         std::span<const NamedObject> estimates,
                                         const std::vector<bool>& counts, double min_overlap);

/// Area of the faces of a mesh, of any label, whose centroids are in each box or at most 0.1 m
/// outside [m^2]. The lowest 0.1 m of the box do not count, because there is ground.
[[nodiscard]] std::vector<double> mapped_surfaces_m2(const LabelledMesh& mesh,
                                                     std::span<const NamedObject> objects);

[[nodiscard]] std::string to_table(const ObjectScores& scores);
[[nodiscard]] Json to_json(const ObjectScores& scores);

}  // namespace km
