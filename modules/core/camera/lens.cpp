#include "modules/core/camera/lens.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace km {
namespace {

constexpr double kConverged = 1e-24;  // squared error in focal lengths, for a target of at most one
constexpr int kMaxSteps = 20;
constexpr double kOnAxis = 1e-9;  // nearer to the axis, equidistant lenses do not move bearings

// The first value within [0, end] for which `holds` is false; `end` if there is none. Intervals of
// less than a thousandth of the range may be missed.
template <typename Condition>
double first_failure(double end, const Condition& holds) {
  constexpr int kCells = 1000;
  double low = 0.0, high = end;
  int cell = 1;
  while (cell <= kCells && holds(end * cell / kCells)) ++cell;
  if (cell > kCells) return end;
  low = end * (cell - 1) / kCells;
  high = end * cell / kCells;
  for (int i = 0; i < 40; ++i) {
    const double middle = 0.5 * (low + high);
    (holds(middle) ? low : high) = middle;
  }
  return low;
}

// A function of one variable, and its derivative.
struct Slope {
  double value, slope;
};

// Argument at which `function` has the value `target`; nullopt if it is not within [0, end].
// `function` is 0 at 0 and increases up to `end`. Newton's method with bounds that shrink.
template <typename Function>
std::optional<double> inverse_rising(double target, double end, const Function& function) {
  const double tolerance = kConverged * std::max(1.0, target * target);
  double low = 0.0, high = end, x = std::min(target, end);
  for (int i = 0; i < 3 * kMaxSteps && low < high; ++i) {
    const Slope at = function(x);
    const double error = at.value - target;
    if (error * error < tolerance) return x;
    (error < 0.0 ? low : high) = x;
    const double next = x - error / at.slope;
    x = next > low && next < high ? next : 0.5 * (low + high);
  }
  return std::nullopt;
}

// Distorted point and its Jacobian with respect to the undistorted one.
struct Distorted {
  Eigen::Vector2d point;
  Eigen::Matrix2d J;
};

// x -> g(r^2) x + tangential terms, g = (1 + k1 r^2 + k2 r^4 + k3 r^6) / (1 + k4 r^2 + ...), r =
// |x|.
class RadialTangential {
 public:
  explicit RadialTangential(const double* k)
      : k_(k), four_(k[4] == 0.0 && k[5] == 0.0 && k[6] == 0.0 && k[7] == 0.0) {}

  [[nodiscard]] Eigen::Vector2d point(const Eigen::Vector2d& p) const {
    const double r2 = p.squaredNorm();
    return moved(p, r2, radial(r2).factor);
  }

  [[nodiscard]] Distorted with_jacobian(const Eigen::Vector2d& p) const {
    const double x = p.x(), y = p.y(), p1 = k_[2], p2 = k_[3];
    const double r2 = p.squaredNorm();
    const Radial g = radial(r2);
    Distorted result;
    result.point = moved(p, r2, g.factor);
    const double slope = 2.0 * g.slope;  // d(factor)/dx = slope * x
    const double cross = slope * x * y + 2.0 * p1 * x + 2.0 * p2 * y;
    result.J << g.factor + slope * x * x + 2.0 * p1 * y + 6.0 * p2 * x, cross,  //
        cross, g.factor + slope * y * y + 6.0 * p1 * y + 2.0 * p2 * x;
    return result;
  }

  // The largest radius, at most `end`, up to which J is positive definite. J is symmetric: the
  // distortion is the gradient of a function that is convex on that disc, and therefore one-to-one
  // there. The eigenvalues of the radial part are g and g + 2 r^2 g', those of the tangential part
  // are at least -6 |(p1, p2)| r.
  [[nodiscard]] double max_radius(double end) const {
    const double tangential = 6.0 * std::hypot(k_[2], k_[3]);
    return first_failure(end, [&](double r) {
      const double least = std::min(radial(r * r).factor, on_radius(r).slope);
      return denominator(r * r) > 0.0 && least > tangential * r;
    });
  }

  // r g(r^2).
  [[nodiscard]] Slope on_radius(double r) const {
    const Radial g = radial(r * r);
    return {r * g.factor, g.factor + 2.0 * r * r * g.slope};
  }

 private:
  struct Radial {
    double factor, slope;  // g and its derivative with respect to r^2
  };

  [[nodiscard]] double denominator(double r2) const {
    return 1.0 + r2 * (k_[5] + r2 * (k_[6] + r2 * k_[7]));
  }

  [[nodiscard]] Radial radial(double r2) const {
    const double k1 = k_[0], k2 = k_[1], k3 = k_[4], k4 = k_[5], k5 = k_[6], k6 = k_[7];
    if (four_) return {1.0 + r2 * (k1 + r2 * k2), k1 + 2.0 * k2 * r2};
    const double above = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
    const double below = denominator(r2);
    const double factor = above / below;
    return {factor, (k1 + r2 * (2.0 * k2 + 3.0 * r2 * k3) -
                     factor * (k4 + r2 * (2.0 * k5 + 3.0 * r2 * k6))) /
                        below};
  }

  [[nodiscard]] Eigen::Vector2d moved(const Eigen::Vector2d& p, double r2, double factor) const {
    const double x = p.x(), y = p.y(), p1 = k_[2], p2 = k_[3];
    return {x * factor + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
            y * factor + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y};
  }

  const double* k_;  // k1, k2, p1, p2, k3, k4, k5, k6; zeros at the end for an omnidirectional lens
  // True if the last four are 0, as for most lenses; their terms are then skipped.
  bool four_;
};

// Newton's method on the disc of radius `max_radius`.
std::optional<Eigen::Vector2d> newton(const RadialTangential& distortion, Eigen::Vector2d p,
                                      const Eigen::Vector2d& target, double max_radius) {
  const double max_r2 = max_radius * max_radius;
  const double tolerance = kConverged * std::max(1.0, target.squaredNorm());
  for (int i = 0; i < kMaxSteps; ++i) {
    const double r2 = p.squaredNorm();
    if (!(r2 <= max_r2)) p *= max_radius / std::sqrt(r2);
    const Distorted at = distortion.with_jacobian(p);
    const Eigen::Vector2d error = at.point - target;
    if (error.squaredNorm() < tolerance) return p;
    p -= at.J.inverse() * error;
  }
  return std::nullopt;
}

// The point of the disc with the image `target`. Newton's method finds it from `target` itself if
// the radial factor is monotonic, as for most lenses. Otherwise it starts at the solution of the
// radial part alone.
std::optional<Eigen::Vector2d> inverse_of(const RadialTangential& distortion,
                                          const Eigen::Vector2d& target, double max_radius) {
  if (const auto found = newton(distortion, target, target, max_radius)) return found;
  const double r = target.norm();
  if (!std::isfinite(r)) return std::nullopt;
  const auto radius =
      inverse_rising(r, max_radius, [&distortion](double at) { return distortion.on_radius(at); });
  return newton(distortion, target * (radius.value_or(max_radius) / r), target, max_radius);
}

// theta_d = theta (1 + k1 theta^2 + k2 theta^4 + k3 theta^6 + k4 theta^8).
Slope equidistant(const Lens::Coefficients& k, double theta) {
  const double t = theta * theta;
  return {theta * (1.0 + t * (k[0] + t * (k[1] + t * (k[2] + t * k[3])))),
          1.0 + t * (3.0 * k[0] + t * (5.0 * k[1] + t * (7.0 * k[2] + t * 9.0 * k[3])))};
}

// Mei and Rives: the point on the plane of a bearing b is b / (1 + xi |(b, 1)|).
double sphere_scale(double xi, double r2) {
  return 1.0 / (1.0 + xi * std::sqrt(1.0 + r2));
}

// The bearing of the ray (plane * scale, z); nullopt if it is not within `max_bearing`.
std::optional<Eigen::Vector2d> bearing_of(const Eigen::Vector2d& plane, double scale, double z,
                                          double max_bearing) {
  const Eigen::Vector2d bearing = plane * (scale / z);
  if (!(z > 0.0) || !(bearing.squaredNorm() <= max_bearing * max_bearing)) return std::nullopt;
  return bearing;
}

// The bearing of a point on that plane (the lifting function of Mei and Rives). If a radicand is
// negative, the result is NaN, and the point has no bearing.
std::optional<Eigen::Vector2d> lifted(double xi, const Eigen::Vector2d& m, double max_bearing) {
  const double r2 = m.squaredNorm();
  const double eta = (xi + std::sqrt(1.0 + (1.0 - xi * xi) * r2)) / (r2 + 1.0);
  return bearing_of(m, eta, eta - xi, max_bearing);
}

// Projection of the double sphere (Usenko et al.) at z = 1.
Eigen::Vector2d double_sphere(double xi, double alpha, const Eigen::Vector2d& b) {
  const double r2 = b.squaredNorm();
  const double z = 1.0 + xi * std::sqrt(1.0 + r2);
  return b * ((1.0 + xi) / (alpha * std::sqrt(r2 + z * z) + (1.0 - alpha) * z));
}

// Inverse of double_sphere(); nullopt outside `max_bearing`.
std::optional<Eigen::Vector2d> inverse_double_sphere(double xi, double alpha,
                                                     const Eigen::Vector2d& point,
                                                     double max_bearing) {
  const Eigen::Vector2d m = point / (1.0 + xi);
  const double r2 = m.squaredNorm();
  const double root = std::sqrt(1.0 - (2.0 * alpha - 1.0) * r2);
  const double m_z = (1.0 - alpha * alpha * r2) / (alpha * root + 1.0 - alpha);
  const double scale = (m_z * xi + std::sqrt(m_z * m_z + (1.0 - xi * xi) * r2)) / (m_z * m_z + r2);
  return bearing_of(m, scale, scale * m_z - xi, max_bearing);
}

// The bearing up to which the image radius increases with the bearing. The paper's region of valid
// points is that of a positive denominator; with a xi near -1 the image folds back within it.
double max_double_sphere_bearing(double xi, double alpha, double end) {
  return first_failure(end, [&](double r) {
    const double z = 1.0 + xi * std::sqrt(1.0 + r * r), dz = xi * r / std::sqrt(1.0 + r * r);
    const double d = std::hypot(r, z);
    const double below = alpha * d + (1.0 - alpha) * z;
    return below > 0.0 && below > r * (alpha * (r + z * dz) / d + (1.0 - alpha) * dz);
  });
}

bool is_count(LensModel model, std::size_t count) {
  switch (model) {
    case LensModel::kRadialTangential:
      return count == 4 || count == 5 || count == 8;
    case LensModel::kEquidistant:
      return count == 4;
    case LensModel::kOmnidirectional:
      return count == 5;
    case LensModel::kDoubleSphere:
      return count == 2 || count == 3;
  }
  return false;
}

void require_usable(LensModel model, const std::vector<double>& k) {
  const std::string lens = to_string(model) + " lens: ";
  if (!is_count(model, k.size()))
    throw std::invalid_argument(lens + std::to_string(k.size()) + " coefficients");
  for (const double value : k)
    if (!std::isfinite(value)) throw std::invalid_argument(lens + "a coefficient is not finite");
  if (model == LensModel::kOmnidirectional && k[0] < 0.0)
    throw std::invalid_argument(lens + "xi = " + std::to_string(k[0]) + " is below 0");
  if (model != LensModel::kDoubleSphere) return;
  if (!(k[0] > -1.0 && k[0] <= 1.0))
    throw std::invalid_argument(lens + "xi = " + std::to_string(k[0]) + " is not within (-1, 1]");
  if (!(k[1] >= 0.0 && k[1] <= 1.0))
    throw std::invalid_argument(lens + "alpha = " + std::to_string(k[1]) + " is not within [0, 1]");
  if (k.size() == 3 && !(k[2] > 0.0))
    throw std::invalid_argument(lens + "beta = " + std::to_string(k[2]) + " is not positive");
}

// The root of beta of a double-sphere lens: 1 without beta.
double root_beta(const Lens::Coefficients& k) {
  return k[2] > 0.0 ? std::sqrt(k[2]) : 1.0;
}

// The largest radius of points of radial-tangential distortion, from the largest bearing.
double plane_radius(double xi, double bearing) {
  return bearing * sphere_scale(xi, bearing * bearing);
}

}  // namespace

std::string to_string(LensModel model) {
  constexpr std::array kNames = {"radial-tangential", "equidistant", "omnidirectional",
                                 "double sphere"};  // in the order of LensModel
  return kNames.at(static_cast<std::size_t>(model));
}

Lens::Lens(LensModel model, const std::vector<double>& coefficients)
    : model_(model), count_(coefficients.size()) {
  require_usable(model, coefficients);
  const Coefficients& k = coefficients_;
  std::copy(coefficients.begin(), coefficients.end(), coefficients_.begin());
  switch (model) {
    case LensModel::kRadialTangential:
      max_bearing_ = max_plane_ = RadialTangential(k.data()).max_radius(kMaxBearing);
      return;
    case LensModel::kEquidistant: {
      const double end = std::atan(kMaxBearing);
      max_plane_ = first_failure(end, [&](double a) { return equidistant(k, a).slope > 0.0; });
      if (max_plane_ < end) max_bearing_ = std::tan(max_plane_);
      return;
    }
    case LensModel::kOmnidirectional: {
      const double end = plane_radius(k[0], kMaxBearing);
      max_plane_ = RadialTangential(k.data() + 1).max_radius(end);
      if (max_plane_ < end) max_bearing_ = lifted(k[0], {max_plane_, 0.0}, kMaxBearing).value().x();
      return;
    }
    case LensModel::kDoubleSphere:
      max_bearing_ =
          max_double_sphere_bearing(k[0], k[1], kMaxBearing * root_beta(k)) / root_beta(k);
      return;
  }
}

bool Lens::is_ideal() const {
  return model_ == LensModel::kRadialTangential && coefficients_ == Coefficients{};
}

std::optional<Eigen::Vector2d> Lens::distorted(const Eigen::Vector2d& bearing) const {
  const Coefficients& k = coefficients_;
  const double r2 = bearing.squaredNorm();
  if (!(r2 <= max_bearing_ * max_bearing_)) return std::nullopt;
  switch (model_) {
    case LensModel::kRadialTangential:
      return RadialTangential(k.data()).point(bearing);
    case LensModel::kEquidistant: {
      const double r = std::sqrt(r2);
      if (r < kOnAxis) return bearing;
      return Eigen::Vector2d(bearing * (equidistant(k, std::atan(r)).value / r));
    }
    case LensModel::kOmnidirectional: {
      const Eigen::Vector2d m = bearing * sphere_scale(k[0], r2);
      return Eigen::Vector2d((1.0 + k[0]) * RadialTangential(k.data() + 1).point(m));
    }
    case LensModel::kDoubleSphere:
      return double_sphere(k[0], k[1], bearing * root_beta(k)) / root_beta(k);
  }
  return std::nullopt;
}

std::optional<Eigen::Vector2d> Lens::undistorted(const Eigen::Vector2d& point) const {
  const Coefficients& k = coefficients_;
  switch (model_) {
    case LensModel::kRadialTangential:
      return inverse_of(RadialTangential(k.data()), point, max_plane_);
    case LensModel::kEquidistant: {
      const double target = point.norm();
      if (target < kOnAxis) return point;
      const auto theta =
          inverse_rising(target, max_plane_, [&](double angle) { return equidistant(k, angle); });
      if (!theta) return std::nullopt;
      return Eigen::Vector2d(point * (std::tan(*theta) / target));
    }
    case LensModel::kOmnidirectional: {
      const Eigen::Vector2d on_plane = point / (1.0 + k[0]);
      const auto m = inverse_of(RadialTangential(k.data() + 1), on_plane, max_plane_);
      return m ? lifted(k[0], *m, max_bearing_) : std::nullopt;
    }
    case LensModel::kDoubleSphere: {
      const double root = root_beta(k);
      const auto bearing = inverse_double_sphere(k[0], k[1], point * root, max_bearing_ * root);
      return bearing ? std::optional<Eigen::Vector2d>(*bearing / root) : std::nullopt;
    }
  }
  return std::nullopt;
}

}  // namespace km
