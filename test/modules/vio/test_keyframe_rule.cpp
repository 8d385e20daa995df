#include <catch2/catch.hpp>

#include "modules/core/covariance.hpp"
#include "modules/vio/keyframe_rule.hpp"

namespace km {
namespace {

TEST_CASE("A speed persists for about a second", "[vio]") {
  CHECK(coasting_s(0.0) == 0.0);
  CHECK(coasting_s(0.1) == Approx(0.05).epsilon(0.05));  // both ends together cover all of the time
  CHECK(coasting_s(2.0) < 1.0);
  CHECK(coasting_s(1e9) == Approx(1.0));
}

TEST_CASE("The covariance across a new start grows with the time without images and the speed",
          "[vio]") {
  const Matrix6 at_once = restart_covariance();
  CHECK(at_once.isDiagonal());
  CHECK(at_once(2, 2) == Approx(0.09));
  CHECK(at_once(3, 3) == Approx(1.0));
  const Eigen::Vector3d up = Eigen::Vector3d(1.0, 2.0, 2.0) / 3.0;
  const Matrix6 later = restart_covariance({.lasts_s = 4.0, .speed_mps = 1.0, .up_body = up});
  CHECK(is_covariance(later));
  CHECK(up.dot(later.topLeftCorner<3, 3>() * up) == Approx(0.09 + 0.25 * 4.0));
  const Eigen::Vector3d level = up.unitOrthogonal();
  CHECK(level.dot(later.topLeftCorner<3, 3>() * level) == Approx(0.09));
  CHECK(later(4, 4) == Approx(1.0 + 4.0));
  CHECK(restart_covariance({.lasts_s = 4.0})(4, 4) == Approx(1.0 + 1.0));
  const Matrix6 anywhere = restart_covariance({.lasts_s = 1e9, .speed_mps = 30.0, .up_body = up});
  CHECK(is_covariance(anywhere));
  CHECK(anywhere.diagonal().maxCoeff() <= 1e6);
  CHECK(up.dot(anywhere.topLeftCorner<3, 3>() * up) < 4.0);
}

}  // namespace
}  // namespace km
