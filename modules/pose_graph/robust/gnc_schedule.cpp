#include "modules/pose_graph/robust/gnc_schedule.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <stdexcept>
#include <string>
#include <utility>

#include "modules/outlier_rejection/chi_squared.hpp"

namespace km {
namespace {

constexpr double kInlierProbability = 0.99;
// From here on a weight strictly between 0 and 1 needs a residual within half a percent of barc:
// weights are rounded, and a few more updates let the borderline cases come to rest.
constexpr double kHardMu = 100.0;
constexpr int kHardUpdates = 3;

double chi_squared_3(double x) {
  return std::erf(std::sqrt(0.5 * x)) - std::sqrt(2.0 * x / std::numbers::pi) * std::exp(-0.5 * x);
}

double chi_squared_3_quantile(double probability) {
  double below = 0.0, above = 1000.0;
  for (int i = 0; i < 64; ++i) {
    const double middle = 0.5 * (below + above);
    (chi_squared_3(middle) < probability ? below : above) = middle;
  }
  return 0.5 * (below + above);
}

double length_quantile(double probability, int dimension) {
  return std::sqrt(dimension == 2 ? chi_squared_3_quantile(probability)
                                  : chi_squared_6_quantile(probability));
}

// Robots, or parts of a team, that hang together.
class Parts {
 public:
  explicit Parts(std::size_t robots) : up_(robots) { std::iota(up_.begin(), up_.end(), 0U); }

  // False if they were in one part already.
  bool join(const GncCandidate& pair) {
    const std::size_t a = root(pair.a);
    const std::size_t b = root(pair.b);
    up_[a] = b;
    return a != b;
  }

 private:
  std::size_t root(std::size_t k) {
    while (up_[k] != k) k = up_[k] = up_[up_[k]];
    return k;
  }

  std::vector<std::size_t> up_;
};

}  // namespace

void check(const GncOptions& options) {
  if (!(options.barc >= 0.0 && std::isfinite(options.barc)))
    throw std::invalid_argument("GNC: barc is " + std::to_string(options.barc) +
                                ", not a positive number of sigmas (or 0 for the default)");
  if (!(options.mu_step > 1.0 && std::isfinite(options.mu_step)))
    throw std::invalid_argument("GNC: mu_step is " + std::to_string(options.mu_step) +
                                ", not above 1");
  if (options.max_updates < 1)
    throw std::invalid_argument("GNC: max_updates is " + std::to_string(options.max_updates));
}

double default_barc(int dimension) {
  return length_quantile(kInlierProbability, dimension);
}

double gnc_weight(double squared_residual, double squared_barc, double mu) {
  if (std::isinf(mu)) return squared_residual <= squared_barc ? 1.0 : 0.0;
  if (squared_residual * (mu + 1.0) <= mu * squared_barc) return 1.0;
  if (squared_residual * mu >= (mu + 1.0) * squared_barc) return 0.0;
  return std::clamp(std::sqrt(mu * (mu + 1.0) * squared_barc / squared_residual) - mu, 0.0, 1.0);
}

double gnc_first_mu(double largest_squared_residual, double squared_barc) {
  const double beyond = 2.0 * largest_squared_residual - squared_barc;
  return beyond > 0.0 ? squared_barc / beyond : std::numeric_limits<double>::infinity();
}

GncSchedule::GncSchedule(std::vector<GncCandidate> candidates, std::size_t robots,
                         std::vector<GncCandidate> joined, const GncOptions& options, int dimension)
    : candidates_(std::move(candidates)),
      joined_(std::move(joined)),
      robots_(robots),
      options_(options),
      barc_(options.barc > 0.0 ? options.barc : default_barc(dimension)),
      weights_(candidates_.size(), 1.0),
      bridge_(candidates_.size(), false) {
  check(options);
  for (const auto* pairs : {&candidates_, &joined_})
    for (const GncCandidate& pair : *pairs)
      if (pair.a >= robots || pair.b >= robots)
        throw std::invalid_argument("GncSchedule: an edge between robots " +
                                    std::to_string(pair.a) + " and " + std::to_string(pair.b) +
                                    " of " + std::to_string(robots));
}

bool GncSchedule::update(std::span<const float> residuals) {
  if (residuals.size() != candidates_.size())
    throw std::invalid_argument("GncSchedule: " + std::to_string(residuals.size()) +
                                " residuals for " + std::to_string(candidates_.size()) +
                                " candidates");
  if (!std::all_of(residuals.begin(), residuals.end(), [](float r) { return r >= 0.0F; }))
    throw std::invalid_argument("GncSchedule: a residual is negative or not a number");
  if (decided_) return false;
  const double c2 = barc_ * barc_;
  const float largest =
      residuals.empty() ? 0.0F : *std::max_element(residuals.begin(), residuals.end());
  mu_ = updates_ == 0 ? gnc_first_mu(static_cast<double>(largest) * largest, c2)
                      : mu_ * options_.mu_step;
  const std::vector<double> before = weights_;
  set_weights(residuals);
  join_parts(residuals);
  ++updates_;
  const bool hard = mu_ >= kHardMu;
  if (hard) ++hard_updates_;
  const bool binary = std::all_of(weights_.begin(), weights_.end(), [](double w) {
    return w == 0.0 || w == 1.0 || w == kJointWeight;
  });
  decided_ = (binary && weights_ == before) ||
             (hard && (weights_ == before || hard_updates_ >= kHardUpdates)) ||
             updates_ >= options_.max_updates;
  return true;
}

void GncSchedule::set_weights(std::span<const float> residuals) {
  const double c2 = barc_ * barc_;
  const bool last = mu_ >= kHardMu || updates_ + 1 >= options_.max_updates;
  for (std::size_t k = 0; k < weights_.size(); ++k) {
    const double r = residuals[k];
    double& weight = weights_[k];
    weight = gnc_weight(r * r, c2, mu_);
    if (last) weight = weight >= 0.5 ? 1.0 : 0.0;
    if (candidates_[k].odometry) weight = std::max(weight, kJointWeight);
  }
}

void GncSchedule::join_parts(std::span<const float> residuals) {
  Parts parts(robots_);
  for (const GncCandidate& pair : joined_) parts.join(pair);
  for (std::size_t k = 0; k < weights_.size(); ++k)
    if (weights_[k] > 0.0 && !bridge_[k]) parts.join(candidates_[k]);
  // A bridge has no residual to speak of, so that it comes first and stays, if still needed.
  std::vector<std::size_t> order;
  for (std::size_t k = 0; k < weights_.size(); ++k)
    if (bridge_[k] || weights_[k] == 0.0) order.push_back(k);
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return std::pair(residuals[a], a) < std::pair(residuals[b], b);
  });
  for (const std::size_t k : order) {
    const bool was_bridge = bridge_[k];
    bridge_[k] = parts.join(candidates_[k]);
    // One that is no longer needed has to prove itself first, at its next residual.
    weights_[k] = bridge_[k] ? 1.0 : was_bridge ? 0.0 : weights_[k];
  }
}

}  // namespace km
