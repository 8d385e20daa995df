#pragma once

namespace km {

/// How well the newest image fits the estimate: errors of the image points of located landmarks
/// after the optimisation, before outliers are dropped.
struct ImageFit {
  int points = 0;         ///< Points in the left and the right image.
  int contradicting = 0;  ///< Points farther than VioConfig::outlier_px from their projection.
};

/// Decides whether the images contradict the estimate. The smoother drops the points that
/// contradict its estimate. If the estimate is wrong, it therefore drops right points, and neither
/// its cost nor its covariance shows the error.
///
/// An image contradicts the estimate if more than kContradictingShare of its points do. The tracker
/// has already dropped the points that contradict the common motion of the others. Each other point
/// contradicts a right estimate with a probability of at most 0.05. By the binomial distribution an
/// image of kMinPoints points then contradicts it with a probability below kFalseRate, and an image
/// of more points with a lower one. Images with fewer points are not judged.
///
/// A cumulative sum decides over the sequence of images (Page, "Continuous Inspection Schemes",
/// Biometrika 1954). It adds the logarithms of the likelihood ratios and is never below zero. The
/// ratio is that of a wrong estimate, which kTrueRate of the images contradict, to a right one.
/// The likelihood ratio from some image on has a mean of 1 if the estimate is right. By Markov's
/// inequality for such sequences (Ville) it reaches exp(h) with a probability of at most exp(-h).
/// For a threshold h and independent images there are thus at least exp(h) images on average before
/// a false alarm. kAlarm allows one in 1e8 images, 58 days at 20 Hz.
class EstimateWatch {
 public:
  static constexpr int kMinPoints = 8;
  static constexpr double kContradictingShare = 0.25;
  static constexpr double kFalseRate = 0.01;
  static constexpr double kTrueRate = 0.5;
  static constexpr double kAlarm = 18.4;  // ln(1e8)

  void add(const ImageFit& fit);

  /// True if the images contradict the estimate.
  [[nodiscard]] bool is_contradicted() const { return evidence_ >= kAlarm; }
  [[nodiscard]] double evidence() const { return evidence_; }

 private:
  double evidence_ = 0.0;  // the cumulative sum
};

}  // namespace km
