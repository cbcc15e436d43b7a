// Whether two sensors give the same samples.
#pragma once

#include <cstddef>
#include <vector>

#include <gtest/gtest.h>

#include "support.hpp"

namespace viwo {

template <class Sample>
void expect_equal(const std::vector<Measurement>& a, const std::vector<Measurement>& b,
                  void (*compare)(const Sample&, const Sample&)) {
  const auto x = only<Sample>(a), y = only<Sample>(b);
  ASSERT_EQ(x.size(), y.size());
  for (std::size_t i = 0; i < x.size(); ++i) {
    EXPECT_EQ(x[i].t_ns, y[i].t_ns);
    compare(x[i], y[i]);
  }
}

/// To the bit, pixels too, but for the cells of encoders.
inline void expect_same(const std::vector<Measurement>& a, const std::vector<Measurement>& b) {
  expect_equal<ImuSample>(a, b, [](const ImuSample& x, const ImuSample& y) {
    EXPECT_EQ(x.gyro_rad_per_s, y.gyro_rad_per_s);
    EXPECT_EQ(x.accel_m_per_s2, y.accel_m_per_s2);
  });
  expect_equal<EncoderSample>(a, b, [](const EncoderSample& x, const EncoderSample& y) {
    EXPECT_EQ(x.drive_rad_per_s, y.drive_rad_per_s);
    EXPECT_EQ(x.steer_rad, y.steer_rad);
  });
  expect_equal<PoseSample>(a, b, [](const PoseSample& x, const PoseSample& y) {
    EXPECT_EQ(x.p_BinW_m, y.p_BinW_m);
    EXPECT_EQ(x.q_BtoW_xyzw, y.q_BtoW_xyzw);
  });
  expect_equal<GnssSample>(a, b, [](const GnssSample& x, const GnssSample& y) {
    EXPECT_EQ(x.latitude_deg, y.latitude_deg);
    EXPECT_EQ(x.longitude_deg, y.longitude_deg);
    EXPECT_EQ(x.altitude_m, y.altitude_m);
    EXPECT_EQ(x.covariance_ENU_m2, y.covariance_ENU_m2);
  });
  expect_equal<ImageSample>(a, b, [](const ImageSample& x, const ImageSample& y) {
    Image left, right;
    x.source->read(left);
    y.source->read(right);
    EXPECT_EQ(x.camera, y.camera);
    EXPECT_EQ(left.width_px, right.width_px);
    EXPECT_EQ(left.pixels, right.pixels);
  });
}

}  // namespace viwo
