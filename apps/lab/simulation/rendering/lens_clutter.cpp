#include "apps/lab/simulation/rendering/lens_clutter.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "apps/lab/simulation/world/seeded_random.hpp"
#include "modules/core/geometry/geometry.hpp"

namespace km {
namespace {

constexpr double kRainReach_m = 6.0;    // drops farther away are too faint
constexpr double kNearestDrop_m = 0.4;  // nearer ones would be on the lens
constexpr double kDrop_m = 0.006;       // diameter of the largest drops
constexpr double kFall_mps = 7.0;       // its terminal velocity
constexpr float kDropLight = 2.5F;  // a drop gathers light of the sky: share of the image's mean
constexpr float kDirtLight = 0.4F;  // light that dirt scatters: share of the image's mean

// 1 inside, 0 outside, smooth over `edge` around `radius`.
double soft_disc(double distance, double radius, double edge) {
  const double share = std::clamp((radius + 0.5 * edge - distance) / edge, 0.0, 1.0);
  return share * share * (3.0 - 2.0 * share);
}

float mean_of(const std::vector<float>& values) {
  float sum = 0.0F * values.front();
  for (const float value : values) sum += value;
  return sum / static_cast<float>(values.size());
}

void blend(std::vector<float>& light, const std::vector<float>& cover, float level) {
  for (std::size_t i = 0; i < cover.size(); ++i) light[i] += cover[i] * (level - light[i]);
}

}  // namespace

LensClutter::LensClutter(const Camera& camera, const SensorEffectsConfig& config,
                         std::uint64_t seed)
    : camera_(camera), glare_(config.glare), rain_drops_(config.rain_drops) {
  if (config.dirt > 0.0 && config.dirt_spots > 0) cover_with_dirt(config, seed);
}

// Spots of many sizes, out of focus: soft discs of 1 to 6 % of the width, each with its own
// density.
void LensClutter::cover_with_dirt(const SensorEffectsConfig& config, std::uint64_t seed) {
  SeededRandom random(seed);
  const int width = camera_.width, height = camera_.height;
  dirt_.assign(static_cast<std::size_t>(width) * static_cast<std::size_t>(height), 0.0F);
  for (int spot = 0; spot < config.dirt_spots; ++spot) {
    const Eigen::Vector2d center(random.unit() * width, random.unit() * height);
    const double draw = random.unit();
    const double radius = width * (0.01 + 0.05 * draw * draw);
    const double density = config.dirt * (0.4 + 0.6 * random.unit());
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        float& hidden = dirt_[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                              static_cast<std::size_t>(x)];
        const double own =
            density * soft_disc((Eigen::Vector2d(x, y) - center).norm(), radius, radius);
        hidden = std::max(hidden, static_cast<float>(own));
      }
    }
  }
}

// A bright line for each drop, along its way relative to the camera while the shutter is open.
std::vector<float> LensClutter::rain_cover(const Shot& shot) const {
  cv::Mat1b cover(camera_.height, camera_.width, std::uint8_t{0});
  SeededRandom random(shot.rain_seed);
  const SE3 T_cam_body = camera_.T_body_cam.inverse();
  const Eigen::Vector3d omega = shot.body_velocity.head<3>();
  for (int drop = 0; drop < rain_drops_; ++drop) {
    Eigen::Vector3d at;
    for (double& value : at) value = kRainReach_m * (2.0 * random.unit() - 1.0);
    const Eigen::Vector3d velocity =
        kFall_mps * shot.down_body - shot.body_velocity.tail<3>() - omega.cross(at);
    const Eigen::Vector3d half_way = 0.5 * shot.exposure.time_s * velocity;
    const Eigen::Vector3d from_cam = T_cam_body * (at - half_way);
    const Eigen::Vector3d to_cam = T_cam_body * (at + half_way);
    const double depth_m = std::min(from_cam.z(), to_cam.z());
    if (depth_m < kNearestDrop_m) continue;
    const auto from = camera_.project_ray(from_cam), to = camera_.project_ray(to_cam);
    if (!from || !to) continue;
    // A drop narrower than a pixel hides a part of it. A fast one is before each pixel only
    // briefly.
    const double width = camera_.fx * kDrop_m / depth_m;
    const double length = std::max((*to - *from).norm(), 1.0);
    const double opacity = std::min(width, 1.0) * std::clamp(8.0 / length, 0.3, 0.8);
    constexpr int kSubpixelBits = 4;
    const auto fixed = [](const Eigen::Vector2d& p) {
      const Eigen::Vector2d limited = 16.0 * p.cwiseMax(-1e4).cwiseMin(1e4);
      return cv::Point(static_cast<int>(limited.x()), static_cast<int>(limited.y()));
    };
    cv::line(cover, fixed(*from), fixed(*to), cv::Scalar(255.0 * opacity),
             std::max(1, static_cast<int>(width + 0.5)), cv::LINE_AA, kSubpixelBits);
  }
  cv::Mat1f shares;
  cover.convertTo(shares, CV_32F, 1.0 / 255.0);
  return {shares.begin(), shares.end()};
}

// Each light before the lens lifts the whole image, most around its own image, and leaves a row of
// ghosts, mirrored at the centre.
std::vector<float> LensClutter::veil(const Shot& shot) const {
  const int width = camera_.width, height = camera_.height;
  std::vector<float> veil(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  const Eigen::Vector2d center(camera_.cx, camera_.cy);
  for (const LightSource& light : shot.lights) {
    const Eigen::Vector3d to_light = camera_.T_body_cam.linear().transpose() * light.to_light_body;
    constexpr double kGrazing = 0.1;  // beyond this the lens hood hides the light
    if (to_light.z() < kGrazing) continue;
    const Eigen::Vector2d image =
        center +
        to_light.head<2>().cwiseProduct(Eigen::Vector2d(camera_.fx, camera_.fy)) / to_light.z();
    const double strength = glare_ * light.irradiance * to_light.z() * to_light.z();
    std::size_t i = 0;
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x, ++i) {
        const Eigen::Vector2d p(x, y);
        double share = 0.3 + 0.7 * std::exp(-(p - image).norm() / (0.25 * width));
        for (const double along : {0.2, 0.35, 0.6}) {
          const double radius = width * (0.02 + 0.06 * along);
          const Eigen::Vector2d ghost = center - along * (image - center);
          share += 0.4 * soft_disc((p - ghost).norm(), radius, 0.3 * radius);
        }
        veil[i] += static_cast<float>(strength * share);
      }
    }
  }
  return veil;
}

void LensClutter::add_to(std::vector<float>& light, const Shot& shot) const {
  if (light.empty()) return;
  const bool is_clear = rain_drops_ == 0 && dirt_.empty() && !(glare_ > 0.0);
  if (is_clear) return;
  const float mean = mean_of(light);
  if (rain_drops_ > 0) blend(light, rain_cover(shot), kDropLight * mean);
  blend(light, dirt_, kDirtLight * mean);
  if (!(glare_ > 0.0) || shot.lights.empty()) return;
  const std::vector<float> scattered = veil(shot);
  for (std::size_t i = 0; i < light.size(); ++i) {
    constexpr float kLitDirt = 2.0F;  // dirt scatters more than clean glass
    const float dirt = dirt_.empty() ? 0.0F : dirt_[i];
    light[i] += scattered[i] * (1.0F + kLitDirt * dirt);
  }
}

}  // namespace km
