#include "modules/sensors/dataset_reader.hpp"
#include "modules/sensors/node/rig_calibration.hpp"
#include "test/modules/sensors/euroc_folder.hpp"
#include "test/support/corrupted_input.hpp"
#include "test/support/shared_data.hpp"
#include "test/support/temporary_folder.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

// Two cameras that look along the inertial sensor's x axis, at y = 0.1 and y = -0.1 m: T_cam_imu
// maps x to z, y to -x and z to -y.
const std::string kCamera0 =
    "cam0:\n"
    "  T_cam_imu:\n"
    "  - [0.0, -1.0, 0.0, 0.1]\n"
    "  - [0.0, 0.0, -1.0, 0.0]\n"
    "  - [1.0, 0.0, 0.0, -0.05]\n"
    "  - [0.0, 0.0, 0.0, 1.0]\n"
    "  cam_overlaps: [1]\n"
    "  camera_model: pinhole\n"
    "  distortion_coeffs: [-0.28, 0.07, 0.0002, 0.00002]\n"
    "  distortion_model: radtan\n"
    "  intrinsics: [458.6, 457.2, 367.2, 248.3]\n"
    "  resolution: [752, 480]\n"
    "  rostopic: /cam0/image_raw\n"
    "  timeshift_cam_imu: 0.0125\n";
const std::string kCamera1 =
    "cam1:\n"
    "  T_cam_imu:\n"
    "  - [0.0, -1.0, 0.0, -0.1]\n"
    "  - [0.0, 0.0, -1.0, 0.0]\n"
    "  - [1.0, 0.0, 0.0, -0.05]\n"
    "  - [0.0, 0.0, 0.0, 1.0]\n"
    "  T_cn_cnm1:\n"
    "  - [1.0, 0.0, 0.0, -0.2]\n"
    "  - [0.0, 1.0, 0.0, 0.0]\n"
    "  - [0.0, 0.0, 1.0, 0.0]\n"
    "  - [0.0, 0.0, 0.0, 1.0]\n"
    "  camera_model: pinhole\n"
    "  distortion_coeffs: [-0.27, 0.06, 0.0001, 0.00001]\n"
    "  distortion_model: radtan\n"
    "  intrinsics: [457.6, 456.2, 379.2, 255.3]\n"
    "  resolution: [752, 480]\n"
    "  rostopic: /cam1/image_raw\n"
    "  timeshift_cam_imu: 0.0127\n";
const std::string kImu =
    "rostopic: /imu0\n"
    "update_rate: 400.0\n"
    "accelerometer_noise_density: 0.006\n"
    "accelerometer_random_walk: 0.0002\n"
    "gyroscope_noise_density: 0.0004\n"
    "gyroscope_random_walk: 4.0e-06\n";

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  return text.replace(text.find(from), from.size(), to);  // throws if it is not there
}

std::string cut(std::string text, const std::string& from, const std::string& before) {
  const std::size_t begin = text.find(from);
  return text.erase(begin, text.find(before, begin) - begin);
}

// A folder of calibration files.
struct Files {
  TemporaryFolder folder;

  RigCalibration read(const std::string& name, const std::string& text,
                      const RigChoice& choice = {}) const {
    return read_rig({folder.write(name, text)}, choice);
  }
  RigCalibration read_kalibr(const std::string& cameras, const std::string& imu = kImu,
                             const RigChoice& choice = {}) const {
    return read_rig({folder.write("camchain.yaml", cameras), folder.write("imu.yaml", imu)},
                    choice);
  }
};

TEST_CASE("Kalibr's files give the rig that they describe") {
  const Files files;
  const RigCalibration calibration = files.read_kalibr(kCamera0 + kCamera1);
  const Camera& left = calibration.rig.stereo.cameras[0];
  CHECK(left.width == 752);
  CHECK(left.height == 480);
  CHECK(left.fx == 458.6);
  CHECK(left.cy == 248.3);
  CHECK(left.lens == Lens(LensModel::kRadialTangential, {-0.28, 0.07, 0.0002, 0.00002}));
  // A point ahead of the robot, a metre to its left: at the left of the left image.
  CHECK((left.T_body_cam.inverse() * Eigen::Vector3d(3.05, 1.0, 0.0))
            .isApprox(Eigen::Vector3d(-0.9, 0.0, 3.0)));
  CHECK(left.T_body_cam.translation().isApprox(Eigen::Vector3d(0.05, 0.1, 0.0)));
  CHECK(calibration.rig.stereo.T_left_right().translation().isApprox(Eigen::Vector3d(0.2, 0, 0)));
  CHECK(calibration.rig.imu.gyro_noise_density == 0.0004);
  CHECK(calibration.rig.imu.gyro_random_walk == 4e-6);
  CHECK(calibration.rig.imu.accel_noise_density == 0.006);
  CHECK(calibration.rig.imu.accel_random_walk == 0.0002);
  CHECK(calibration.rig.imu.rate_hz == 400.0);
  CHECK_FALSE(calibration.rig.depth.has_value());
  REQUIRE(calibration.image_time_offset_s.has_value());
  CHECK(*calibration.image_time_offset_s == Approx(0.0126));  // common to both cameras
  CHECK(calibration.image_topics ==
        std::array<std::string, 2>{"/cam0/image_raw", "/cam1/image_raw"});
  CHECK(calibration.imu_topic == "/imu0");
  CHECK(calibration.notes.empty());
}

TEST_CASE("All formats for the poses of the cameras agree") {
  const Files files;
  const RigCalibration plain = files.read_kalibr(kCamera0 + kCamera1);
  const std::string inverse0 =
      "  T_imu_cam:\n"
      "  - [0.0, 0.0, 1.0, 0.05]\n"
      "  - [-1.0, 0.0, 0.0, 0.1]\n"
      "  - [0.0, -1.0, 0.0, 0.0]\n"
      "  - [0.0, 0.0, 0.0, 1.0]\n";
  const std::string chained = cut(kCamera1, "  T_cam_imu:\n", "  T_cn_cnm1");
  const std::string openvins = "%YAML:1.0 # need to specify the file type at the top!\n\ncam0:\n" +
                               inverse0 + kCamera0.substr(kCamera0.find("  cam_overlaps"));
  for (const std::string& text : {kCamera0 + chained, openvins + kCamera1, openvins + chained}) {
    const RigCalibration calibration = files.read_kalibr(text);
    for (std::size_t i : {0U, 1U})
      CHECK(calibration.rig.stereo.cameras[i].T_body_cam.isApprox(
          plain.rig.stereo.cameras[i].T_body_cam, 1e-12));
  }
  // Both files in one, and imu0 as Kalibr writes it.
  std::string nested =
      "imu0:\n  T_i_b:\n  - [1, 0, 0, 0]\n  - [0, 1, 0, 0]\n  - [0, 0, 1, 0]\n"
      "  - [0, 0, 0, 1]\n";
  std::string line;
  for (const char c : kImu) {
    line += c;
    if (c == '\n') nested += "  " + std::exchange(line, {});
  }
  const RigCalibration one = files.read("chain.yaml", kCamera0 + kCamera1 + nested);
  CHECK(one.rig.imu.rate_hz == 400.0);
  CHECK(one.imu_topic == "/imu0");
}

TEST_CASE("The models of Kalibr's chains are read") {
  const Files files;
  const auto left_of = [&](const std::string& text) {
    return files.read_kalibr(text + kCamera1).rig.stereo.cameras[0];
  };
  const Camera fisheye = left_of(replaced(kCamera0, "radtan", "equidistant"));
  CHECK(fisheye.lens == Lens(LensModel::kEquidistant, {-0.28, 0.07, 0.0002, 0.00002}));
  const std::string omni_text =
      replaced(replaced(kCamera0, "pinhole", "omni"), "[458.6,", "[0.8, 833.0,");
  const Camera omni = left_of(omni_text);
  CHECK(omni.lens == Lens(LensModel::kOmnidirectional, {0.8, -0.28, 0.07, 0.0002, 0.00002}));
  CHECK(omni.fx == Approx(833.0 / 1.8));  // on the axis
  CHECK(omni.fy == Approx(457.2 / 1.8));
  const std::string none =
      cut(replaced(kCamera0, "radtan", "none"), "  distortion_coeffs", "  distortion_model");
  CHECK(left_of(none).lens.is_ideal());
  const Camera ds =
      left_of(replaced(replaced(none, "pinhole", "ds"), "[458.6,", "[-0.2, 0.6, 458.6,"));
  CHECK(ds.lens == Lens(LensModel::kDoubleSphere, {-0.2, 0.6}));
  CHECK(ds.fx == Approx(458.6 / 0.8));
  const Camera eucm =
      left_of(replaced(replaced(none, "pinhole", "eucm"), "[458.6,", "[0.6, 1.1, 458.6,"));
  CHECK(eucm.lens == Lens(LensModel::kDoubleSphere, {0.0, 0.6, 1.1}));
  CHECK(eucm.fx == 458.6);
  const Camera rational =
      left_of(replaced(kCamera0, "0.00002]", "0.00002, 0.01, 0.1, 0.02, 0.003]"));
  CHECK(rational.lens.coefficients().size() == 8);
}

TEST_CASE("The published calibration of TUM-VI is read") {
  const auto cameras = shared_data("tumvi_rooms/calib/kalibr_imucam_chain.yaml");
  const auto imu = shared_data("tumvi_rooms/calib/kalibr_imu_chain.yaml");
  if (!cameras || !imu) return;
  const RigCalibration calibration = read_rig({*cameras, *imu});
  const StereoRig& stereo = calibration.rig.stereo;
  CHECK(stereo.cameras[0].lens.model() == LensModel::kEquidistant);
  CHECK(stereo.cameras[0].fx == 190.97847715128717);
  CHECK(stereo.baseline_m() == Approx(0.101).margin(0.001));
  // The camera looks along the inertial sensor's -y, as they are mounted in that device.
  CHECK(stereo.cameras[0].T_body_cam.linear().col(2).dot(-Eigen::Vector3d::UnitY()) > 0.99);
  CHECK(calibration.rig.imu.gyro_noise_density == 0.00016);
  CHECK_FALSE(calibration.image_time_offset_s.has_value());
  CHECK(calibration.notes.empty());
}

const std::string kBasalt = R"({
    "value0": {
        "T_imu_cam": [
            {"px": 0.05, "py": 0.1, "pz": 0.0, "qx": -0.5, "qy": 0.5, "qz": -0.5, "qw": 0.5},
            {"px": 0.05, "py": -0.1, "pz": 0.0, "qx": -0.5, "qy": 0.5, "qz": -0.5, "qw": 0.5}
        ],
        "intrinsics": [
            {
                "camera_type": "ds",
                "intrinsics": {
                    "fx": 158.0, "fy": 158.5, "cx": 254.9, "cy": 256.8,
                    "xi": -0.2, "alpha": 0.6
                }
            },
            {
                "camera_type": "kb4",
                "intrinsics": {
                    "fx": 191.0, "fy": 191.5, "cx": 252.5, "cy": 255.0,
                    "k1": 0.003, "k2": 0.0007, "k3": -0.002, "k4": 0.0002
                }
            }
        ],
        "resolution": [[512, 512], [512, 512]],
        "calib_accel_bias": [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        "calib_gyro_bias": [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        "imu_update_rate": 200.5,
        "accel_noise_std": 0.016,
        "gyro_noise_std": [0.000282, 0.0003, 0.00028],
        "accel_bias_std": [0.001, 0.001, 0.001],
        "gyro_bias_std": 0.0001,
        "cam_time_offset_ns": 2124029,
        "vignette": []
    }
}
)";

TEST_CASE("Basalt's file gives the rig that it describes") {
  const Files files;
  std::string text = kBasalt;  // JSON may be indented by tabs
  for (std::size_t at = 0; (at = text.find("    ", at)) != text.npos;) text.replace(at, 4, 1, '\t');
  const RigCalibration calibration = files.read("calib.json", text);
  const Camera &left = calibration.rig.stereo.cameras[0],
               &right = calibration.rig.stereo.cameras[1];
  CHECK(left.width == 512);
  CHECK(left.lens == Lens(LensModel::kDoubleSphere, {-0.2, 0.6}));
  CHECK(left.fx == Approx(158.0 / 0.8));
  CHECK(left.fy == Approx(158.5 / 0.8));
  CHECK(left.cx == 254.9);
  CHECK(right.lens == Lens(LensModel::kEquidistant, {0.003, 0.0007, -0.002, 0.0002}));
  CHECK(right.fx == 191.0);
  CHECK((left.T_body_cam.inverse() * Eigen::Vector3d(3.05, 1.0, 0.0))
            .isApprox(Eigen::Vector3d(-0.9, 0.0, 3.0)));
  CHECK(calibration.rig.stereo.baseline_m() == Approx(0.2));
  CHECK(calibration.rig.imu.gyro_noise_density == 0.0003);
  CHECK(calibration.rig.imu.accel_noise_density == 0.016);
  CHECK(calibration.rig.imu.gyro_random_walk == 0.0001);
  CHECK(calibration.rig.imu.accel_random_walk == 0.001);
  CHECK(calibration.rig.imu.rate_hz == 200.5);
  CHECK(calibration.image_time_offset_s.value() == Approx(2.124029e-3));
  CHECK(calibration.notes.empty());
  CHECK(calibration.image_topics[0].empty());
}

TEST_CASE("Basalt's other models are read") {
  const Files files;
  const auto left_of = [&](const std::string& type, const std::string& more) {
    return files
        .read("calib.json", replaced(replaced(kBasalt, R"("ds")", '"' + type + '"'),
                                     R"("xi": -0.2, "alpha": 0.6)", more))
        .rig.stereo.cameras[0];
  };
  CHECK(left_of("pinhole", R"("unused": 0)").lens.is_ideal());
  const Camera radtan = left_of("pinhole-radtan8",
                                R"("k1": 0.4, "k2": 0.1, "p1": 1e-4, "p2": 2e-4, "k3": 0.01,
                                   "k4": 0.8, "k5": 0.3, "k6": 0.04, "rpmax": 2.7)");
  CHECK(radtan.lens ==
        Lens(LensModel::kRadialTangential, {0.4, 0.1, 1e-4, 2e-4, 0.01, 0.8, 0.3, 0.04}));
  // x / (alpha d + (1 - alpha) z) at (1, 0, 1).
  const Camera ucm = left_of("ucm", R"("alpha": 0.6)");
  CHECK(ucm.project({1.0, 0.0}).value().x() ==
        Approx(254.9 + 158.0 / (0.6 * std::sqrt(2.0) + 0.4)));
  const Camera eucm = left_of("eucm", R"("alpha": 0.6, "beta": 1.1)");
  CHECK(eucm.project({1.0, 0.0}).value().x() ==
        Approx(254.9 + 158.0 / (0.6 * std::sqrt(2.1) + 0.4)));
}

TEST_CASE("An unused part of a calibration is noted with its place") {
  const Files files;
  const auto notes_of = [](const RigCalibration& calibration) {
    REQUIRE(calibration.notes.size() == 1);
    return calibration.notes.front();
  };
  CHECK_THAT(notes_of(files.read("calib.json",
                                 replaced(kBasalt, "accel_bias\": [0.0", "accel_bias\": [0.1"))),
             Contains("calib.json line 24: calib_accel_bias is not applied"));
  CHECK_THAT(notes_of(files.read("camchain.yaml", kCamera0 + kCamera1)),
             Contains("camchain.yaml: no imu0"));
  CHECK_THAT(notes_of(files.read_kalibr(kCamera0 + kCamera1,
                                        kImu + "Tw:\n- [1.01, 0, 0]\n- [0, 1, 0]\n- [0, 0, 1]\n")),
             Contains("imu.yaml line 8: Tw is not applied"));
}

TEST_CASE("A pair is chosen among more cameras, or one with depth") {
  const Files files;
  std::string third = replaced(kCamera1, "cam1:", "cam2:");
  third = replaced(third, "[0.0, -1.0, 0.0, -0.1]", "[0.0, -1.0, 0.0, -0.3]");
  const RigCalibration wide =
      files.read_kalibr(kCamera0 + kCamera1 + third, kImu, {.left = 0, .right = 2});
  CHECK(wide.rig.stereo.baseline_m() == Approx(0.4));
  const RigChoice rgbd{.right = {}, .depth = DepthChoice{{0.3, 8.0}, 0.07}};
  for (const RigCalibration& calibration :
       {files.read_kalibr(kCamera0, kImu, rgbd), files.read("calib.json", kBasalt, rgbd)}) {
    CHECK(calibration.rig.stereo.depth_source == DepthSource::kDepthImage);
    CHECK(calibration.rig.stereo.baseline_m() == Approx(0.07));
    CHECK(calibration.rig.depth.value().max_m == 8.0);
  }
}

TEST_CASE("Files of ROS' camera_calibration give the pair without its pose on the body") {
  const TemporaryFolder folder;
  const auto write = [&folder](const std::string& name, const std::string& Tx) {
    return folder.write(
        name,
        "image_width: 640\nimage_height: 480\ncamera_name: narrow\ncamera_matrix:\n  rows: 3\n"
        "  cols: 3\n  data: [458, 0, 320, 0, 457, 240, 0, 0, 1]\ndistortion_model: plumb_bob\n"
        "distortion_coefficients: {rows: 1, cols: 5, data: [-0.28, 0.07, 0, 0, 0]}\n"
        "rectification_matrix: {rows: 3, cols: 3, data: [1, 0, 0, 0, 1, 0, 0, 0, 1]}\n"
        "projection_matrix: {rows: 3, cols: 4, data: [430, 0, 318, " +
            Tx + ", 0, 430, 239, 0, 0, 0, 1, 0]}\n");
  };
  const auto left = write("left.yaml", "0"), right = write("right.yaml", "-43");
  RigChoice choice{.may_be_partial = true, .rectified = GENERATE(false, true)};
  CAPTURE(choice.rectified);
  const RigCalibration found = read_rig({left, right}, choice);
  CHECK_FALSE(found.has_extrinsics);
  CHECK(found.rig.stereo.cameras[0].fx == (choice.rectified ? 430.0 : 458.0));
  CHECK(found.rig.stereo.baseline_m() == Approx(0.1));
  CHECK_THROWS_WITH(read_rig({left}, choice), Contains("for each camera"));
  CHECK_THROWS_WITH(read_rig({right, left}, choice), Contains("no baseline"));
}

TEST_CASE("A file that is no calibration is refused with a list of the expected formats") {
  const Files files;
  CHECK_THROWS_WITH(read_rig({}), Contains("expected a folder"));
  CHECK_THROWS_WITH(files.read("a.yaml", "some: thing\n"),
                    Contains("a.yaml: neither cam0 nor imu0"));
  CHECK_THROWS_WITH(files.read("a.yaml", kImu), Contains("also name Kalibr's chain of cameras"));
  CHECK_THROWS_WITH(files.read_kalibr(kCamera0), Contains("one camera without depth"));
  const std::string behind = replaced(replaced(cut(kCamera1, "  T_cn_cnm1", "  camera_model"),
                                               "[0.0, -1.0, 0.0, -0.1]", "[0.0, 1.0, 0.0, 0.1]"),
                                      "[1.0, 0.0, 0.0, -0.05]", "[-1.0, 0.0, 0.0, -0.05]");
  CHECK_THROWS_WITH(files.read_kalibr(kCamera0 + behind),
                    Contains("makes the cameras look 180 degrees apart"));
  CHECK_THROWS_WITH(files.read_kalibr(kCamera0 + kCamera1, kCamera0),
                    Contains("imu.yaml: a second file of cam0"));
  CHECK_THROWS_WITH(read_rig({EurocFolder().mav0() / "cam0" / "sensor.yaml"}),
                    Contains("give the folder that holds cam0, cam1 and imu0"));
  check_no_files<DatasetError>(".yaml", [](const fs::path& file) { (void)read_rig({file}); });
}

TEST_CASE("An impossible Kalibr chain is refused with file and line") {
  struct Case {
    std::string from, to, message;
  };
  const Case c = GENERATE(
      Case{"[458.6,", "[0.4,", "line 11: intrinsics: a focal length of 0.4 px"},
      Case{"T_cam_imu", "T_cam_imx", "line 2: cam0: key T_cam_imu is missing"},
      Case{"[1.0, 0.0, 0.0, -0.05]", "[1.5, 0.0, 0.0, -0.05]",
           "line 3: T_cam_imu is not a rotation"},
      Case{"[0.0, -1.0, 0.0, 0.1]", "[0.0, -1.0, 0.0, -0.4]",
           "line 17: cam1 puts the right camera to the left"},
      Case{"0.0125", "0.0325", "line 32: timeshift_cam_imu: 0.0127 s, but 0.0325 s of the left"},
      Case{"0.0125", "1e9", "line 14: timeshift_cam_imu is not a number within -10 .. 10"});
  CAPTURE(c.from, c.to);
  const Files files;
  CHECK_THROWS_WITH(files.read_kalibr(replaced(kCamera0, c.from, c.to) + kCamera1),
                    Contains("camchain.yaml " + c.message));
}

TEST_CASE("An impossible Basalt file is refused with file and line") {
  struct Case {
    std::string from, to, message;
  };
  const Case c = GENERATE(
      Case{R"("ds")", R"("fov")", "line 9: camera_type 'fov' is not supported"},
      Case{R"("alpha": 0.6)", R"("alpha": 1.6)", "line 9: camera_type: double sphere lens: alpha"},
      Case{R"("qw": 0.5})", R"("qw": 1.5})", "line 4: T_imu_cam: a quaternion of norm"},
      Case{R"([[512, 512], )", "[", "line 7: intrinsics of 2 cameras, but T_imu_cam of 2 and"},
      Case{R"("fx": 158.0)", R"("fx": "x")", "line 11: fx is not a number"},
      Case{"0.016", "1e9", "line 27: accel_noise_std is not a number within"},
      Case{"2124029", "1e300", "cam_time_offset_ns is not a number within"});
  CAPTURE(c.from, c.to);
  const Files files;
  CHECK_THROWS_WITH(files.read("calib.json", replaced(kBasalt, c.from, c.to)),
                    Contains("calib.json ") && Contains(c.message));
}

void check_calibration(const RigCalibration& calibration) {
  check_rig(calibration.rig);
  CHECK(std::abs(calibration.image_time_offset_s.value_or(0.0)) <= 10.0);
}

TEST_CASE("A corrupted calibration is refused or gives a valid rig") {
  const TemporaryFolder folder;
  SECTION("Kalibr") {
    check_corrupted<DatasetError>(
        kCamera0 + kCamera1 + "imu0:\n  " +
            "T_i_b: [1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,1]\n  update_rate: 200\n  "
            "gyroscope_noise_density: 1e-4\n  gyroscope_random_walk: 1e-5\n  "
            "accelerometer_noise_density: 1e-3\n  accelerometer_random_walk: 1e-4\n",
        folder.path().string(), [&](const std::string& text) {
          check_calibration(read_rig({folder.write("chain.yaml", text)}));
        });
  }
  SECTION("Basalt") {
    check_corrupted<DatasetError>(kBasalt, folder.path().string(), [&](const std::string& text) {
      check_calibration(read_rig({folder.write("calib.json", text)}));
    });
  }
}

}  // namespace
}  // namespace km
