#include "digest.hpp"

namespace viwo::conformance {
namespace {

template <class Values>
void add_all(const Values& values, Digest& out) {
  for (const double value : values) out.add(value);
}

void add(const EncoderSample& s, Digest& out) {
  for (int i = 0; i < s.n_drive; ++i) out.add(s.drive_rad_per_s[static_cast<std::size_t>(i)]);
  for (int i = 0; i < s.n_steer; ++i) out.add(s.steer_rad[static_cast<std::size_t>(i)]);
}
void add(const PoseSample& s, Digest& out) {
  add_all(s.p_BinW_m, out);
  add_all(s.q_BtoW_xyzw, out);
}
void add(const ImuSample& s, Digest& out) {
  add_all(s.gyro_rad_per_s, out);
  add_all(s.accel_m_per_s2, out);
}
void add(const FeatureSample& s, Digest& out) {
  for (const FeaturePoint& point : s.points) {
    out.add(point.id);
    out.add(point.u_px);
    out.add(point.v_px);
  }
}
void add(const StateSample& s, Digest& out) {
  add_all(s.q_ItoG_xyzw, out);
  add_all(s.p_IinG_m, out);
  add_all(s.v_IinG_m_per_s, out);
  add_all(s.gyro_bias_rad_per_s, out);
  add_all(s.accel_bias_m_per_s2, out);
}
void add(const CalibrationSample& s, Digest& out) {
  for (const char c : s.name) out.add(static_cast<int>(c));
  out.add(s.value);
}

void add(const ImageSample& s, Digest& out) {
  Image image;
  s.source->read(image);
  out.add(image.width_px);
  for (const std::uint8_t pixel : image.pixels) out.add(static_cast<int>(pixel));
}

}  // namespace

std::uint64_t digest_of(const Measurement& measurement) {
  Digest digest;
  const SampleType& type = measurement.view().type();
  const SampleExtent extent = measurement.view().extent();
  for (const char* c = type.name; *c != '\0'; ++c) digest.add(static_cast<int>(*c));
  digest.add(extent.t_ns);
  digest.add(extent.begin_ns);
  digest.add(extent.end_ns);
  digest.add(type.channel(measurement.view().data()));
  visit_one_of<EncoderSample, PoseSample, ImuSample, FeatureSample, StateSample, CalibrationSample,
               ImageSample>(measurement, [&](const auto& sample) { add(sample, digest); });
  return digest.value();
}

std::uint64_t digest_of(const FactorSink& sink) {
  Digest digest;
  for (const ResidualFactor& factor : sink.residuals()) {
    digest.add(factor.columns);
    digest.add(factor.H);
    digest.add(factor.residual);
    digest.add(factor.R);
    digest.add(factor.gate_probability);
    digest.add(static_cast<int>(factor.heavy_tailed));
    digest.add(static_cast<int>(factor.noise != nullptr));
  }
  if (const InformationFactor* factor = sink.information()) {
    const int n = factor->columns.size();
    digest.add(factor->columns);
    for (int j = 0; j < n; ++j) {
      for (int i = j; i < n; ++i) digest.add(factor->Lambda(i, j));
      digest.add(factor->eta[j]);
    }
  }
  digest.add(sink.applied());
  digest.add(sink.rejected());
  return digest.value();
}

}  // namespace viwo::conformance
