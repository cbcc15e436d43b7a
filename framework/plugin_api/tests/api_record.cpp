// Prints what a plugin that was compiled against viwo/api relies on. Compiled without flags for the
// processor, so that it prints the same everywhere (64 bit, Itanium C++ ABI).
#include "api_record.hpp"

#include "api_record_filter.hpp"
#include "viwo/api/plugin.hpp"
#include "viwo/api/stamp_order.hpp"

namespace {

using namespace viwo;

void constants() {
  CONSTANT(kApiVersion);
  CONSTANT(kMaxDrives);
  CONSTANT(kMaxSteers);
  CONSTANT(kMaxRows);
  CONSTANT(kMaxIntrinsics);
  CONSTANT(kMaxNoises);
  CONSTANT(kMaxFactorRows);
  CONSTANT(kMaxFactorColumns);
  CONSTANT(kMaxFactorBlocks);
  CONSTANT(kThetaColumn);
  CONSTANT(kPositionColumn);
  CONSTANT(kVelocityColumn);
  CONSTANT(kGyroBiasColumn);
  CONSTANT(kAccelBiasColumn);
  CONSTANT(kImuSize);
  CONSTANT(kPoseSize);
  CONSTANT(kMaxRoomEntries);
  CONSTANT(kSameInstantNs);
}

void samples() {
  RECORD(SampleExtent);
  MEMBER(SampleExtent, t_ns);
  MEMBER(SampleExtent, begin_ns);
  MEMBER(SampleExtent, end_ns);
  RECORD(SampleType);
  MEMBER(SampleType, name);
  MEMBER(SampleType, version);
  MEMBER(SampleType, size);
  MEMBER(SampleType, align);
  MEMBER(SampleType, layout);
  MEMBER(SampleType, extent);
  MEMBER(SampleType, channel);
  MEMBER(SampleType, fault);
  MEMBER(SampleType, make_buffer);
  RECORD(SampleView);
  RECORD(SampleBuffer);
  SLOTS(SampleBuffer);
  VIRTUAL(SampleBuffer, type);
  VIRTUAL(SampleBuffer, push);
  VIRTUAL(SampleBuffer, drop_front);
  VIRTUAL(SampleBuffer, at);
  RECORD(Measurement);
}

void measurements() {
  RECORD(EncoderSample);
  MEMBER(EncoderSample, t_ns);
  MEMBER(EncoderSample, begin_ns);
  MEMBER(EncoderSample, end_ns);
  MEMBER(EncoderSample, n_drive);
  MEMBER(EncoderSample, n_steer);
  MEMBER(EncoderSample, drive_rad_per_s);
  MEMBER(EncoderSample, steer_rad);
  MEMBER(EncoderSample, bad_drives);
  MEMBER(EncoderSample, bad_steers);
  SAMPLE(EncoderSample);
  RECORD(ImuSample);
  MEMBER(ImuSample, t_ns);
  MEMBER(ImuSample, gyro_rad_per_s);
  MEMBER(ImuSample, accel_m_per_s2);
  SAMPLE(ImuSample);
  RECORD(FeaturePoint);
  MEMBER(FeaturePoint, id);
  MEMBER(FeaturePoint, u_px);
  MEMBER(FeaturePoint, v_px);
  RECORD(FeatureSample);
  MEMBER(FeatureSample, t_ns);
  MEMBER(FeatureSample, camera);
  MEMBER(FeatureSample, points);
  SAMPLE(FeatureSample);
  RECORD(PoseSample);
  MEMBER(PoseSample, t_ns);
  MEMBER(PoseSample, p_BinW_m);
  MEMBER(PoseSample, q_BtoW_xyzw);
  SAMPLE(PoseSample);
  RECORD(HeadingSample);
  MEMBER(HeadingSample, t_ns);
  MEMBER(HeadingSample, yaw_rad);
  SAMPLE(HeadingSample);
  RECORD(GnssSample);
  MEMBER(GnssSample, t_ns);
  MEMBER(GnssSample, latitude_deg);
  MEMBER(GnssSample, longitude_deg);
  MEMBER(GnssSample, altitude_m);
  MEMBER(GnssSample, covariance_ENU_m2);
  SAMPLE(GnssSample);
  RECORD(StateSample);
  MEMBER(StateSample, t_ns);
  MEMBER(StateSample, q_ItoG_xyzw);
  MEMBER(StateSample, p_IinG_m);
  MEMBER(StateSample, v_IinG_m_per_s);
  MEMBER(StateSample, gyro_bias_rad_per_s);
  MEMBER(StateSample, accel_bias_m_per_s2);
  SAMPLE(StateSample);
  RECORD(CalibrationSample);
  MEMBER(CalibrationSample, t_ns);
  MEMBER(CalibrationSample, name);
  MEMBER(CalibrationSample, value);
  SAMPLE(CalibrationSample);
  RECORD(Image);
  MEMBER(Image, width_px);
  MEMBER(Image, height_px);
  MEMBER(Image, pixels);
  RECORD(ImageSource);
  SLOTS(ImageSource);
  VIRTUAL(ImageSource, read);
  VIRTUAL(ImageSource, read_of_size);
  RECORD(ImageSample);
  MEMBER(ImageSample, t_ns);
  MEMBER(ImageSample, camera);
  MEMBER(ImageSample, source);
  SAMPLE(ImageSample);
}

void descriptor() {
  ENUM(ParamType);
  RECORD(ParamInfo);
  MEMBER(ParamInfo, unit);
  MEMBER(ParamInfo, min);
  MEMBER(ParamInfo, above);
  MEMBER(ParamInfo, max);
  MEMBER(ParamInfo, choices);
  MEMBER(ParamInfo, required);
  MEMBER(ParamInfo, help);
  RECORD(ParamSpec);
  MEMBER(ParamSpec, name);
  MEMBER(ParamSpec, type);
  MEMBER(ParamSpec, size);
  MEMBER(ParamSpec, fallback);
  MEMBER(ParamSpec, fallback_section);
  RECORD(ParamSet);
  std::cout << "  value is " << type_name(typeid(ParamValue)) << "\n";
  RECORD(NestedKinematics);
  MEMBER(NestedKinematics, model);
  RECORD(ParamBinder);
  RECORD(NoParams);
  ENUM(LogLevel);
  RECORD(HostServices);
  MEMBER(HostServices, host);
  MEMBER(HostServices, log_text);
  MEMBER(HostServices, seed);
  MEMBER(HostServices, exact);
  ENUM(ErrorText::Cause);
  RECORD(ErrorText);
  MEMBER(ErrorText, cause);
  MEMBER(ErrorText, key);
  MEMBER(ErrorText, text);
  RECORD(PluginDescriptor);
  MEMBER(PluginDescriptor, struct_size);
  MEMBER(PluginDescriptor, api_version);
  MEMBER(PluginDescriptor, build_record);
  MEMBER(PluginDescriptor, kind);
  MEMBER(PluginDescriptor, name);
  MEMBER(PluginDescriptor, version);
  MEMBER(PluginDescriptor, summary);
  MEMBER(PluginDescriptor, license);
  MEMBER(PluginDescriptor, params);
  MEMBER(PluginDescriptor, create);
  MEMBER(PluginDescriptor, destroy);
  ENUM(Status);
  RECORD(InputError);
  RECORD(ParamError);
  RECORD(ContractError);
}

void kinematics() {
  RECORD(RowMatrix);
  RECORD(RowVector);
  RECORD(RowJacobian);
  RECORD(TwistRowsJacobian);
  RECORD(Intrinsics);
  RECORD(NoiseVector);
  RECORD(RowRange);
  MEMBER(RowRange, first);
  MEMBER(RowRange, count);
  RECORD(IntrinsicSpec);
  MEMBER(IntrinsicSpec, name);
  MEMBER(IntrinsicSpec, unit);
  MEMBER(IntrinsicSpec, nominal);
  MEMBER(IntrinsicSpec, prior_sigma);
  MEMBER(IntrinsicSpec, gauge_fixed);
  MEMBER(IntrinsicSpec, rows);
  MEMBER(IntrinsicSpec, lowest);
  MEMBER(IntrinsicSpec, highest);
  ENUM(NoiseKind);
  RECORD(NoiseSpec);
  MEMBER(NoiseSpec, kind);
  MEMBER(NoiseSpec, channel);
  MEMBER(NoiseSpec, sigma);
  MEMBER(NoiseSpec, rows);
  MEMBER(NoiseSpec, parameter);
  RECORD(ModelDescription);
  MEMBER(ModelDescription, n_drive);
  MEMBER(ModelDescription, n_steer);
  MEMBER(ModelDescription, n_rows);
  MEMBER(ModelDescription, constant_A);
  MEMBER(ModelDescription, noise_block);
  MEMBER(ModelDescription, intrinsics);
  MEMBER(ModelDescription, noises);
  RECORD(RowSystem);
  MEMBER(RowSystem, A);
  MEMBER(RowSystem, b);
  MEMBER(RowSystem, kept);
  RECORD(IntrinsicDerivatives);
  MEMBER(IntrinsicDerivatives, J);
  MEMBER(IntrinsicDerivatives, DtE);
  RECORD(NoiseDerivatives);
  MEMBER(NoiseDerivatives, J);
  MEMBER(NoiseDerivatives, DtE);
  RECORD(KinematicModel);
  SLOTS(KinematicModel);
  VIRTUAL(KinematicModel, describe);
  VIRTUAL(KinematicModel, rows);
  VIRTUAL(KinematicModel, intrinsic_derivatives);
  VIRTUAL(KinematicModel, noise_derivatives);
  VIRTUAL(KinematicModel, inverse);
  VIRTUAL(KinematicModel, move_frame);
}

void sensors() {
  RECORD(NoiseFound);
  MEMBER(NoiseFound, name);
  MEMBER(NoiseFound, unit);
  MEMBER(NoiseFound, configured);
  MEMBER(NoiseFound, found);
  MEMBER(NoiseFound, count);
  RECORD(NoiseScale);
  RECORD(RejectionCount);
  MEMBER(RejectionCount, reason);
  MEMBER(RejectionCount, count);
  MEMBER(RejectionCount, first);
  MEMBER(RejectionCount, of);
  RECORD(Rejections);
  RECORD(LogLimits);
  MEMBER(LogLimits, max_gap_s);
  MEMBER(LogLimits, max_rejected_fraction);
  RECORD(StampJump);
  RECORD(StampOrder);
  RECORD(EstimateSample);
  MEMBER(EstimateSample, t_ns);
  MEMBER(EstimateSample, q_ItoG_xyzw);
  MEMBER(EstimateSample, p_IinG_m);
  MEMBER(EstimateSample, v_IinG_m_per_s);
  MEMBER(EstimateSample, w_IinI_rad_per_s);
  MEMBER(EstimateSample, covariance);
  MEMBER(EstimateSample, latency_s);
  MEMBER(EstimateSample, calibration_names);
  MEMBER(EstimateSample, calibration);
  MEMBER(EstimateSample, calibration_sigma);
  RECORD(Sensor);
  SLOTS(Sensor);
  VIRTUAL(Sensor, yields);
  VIRTUAL(Sensor, next);
  VIRTUAL(Sensor, can_be_exact);
  VIRTUAL(Sensor, rejections);
  VIRTUAL(Sensor, takes_input);
  VIRTUAL(Sensor, connect);
  VIRTUAL(Sensor, live);
  VIRTUAL(Sensor, stop);
  VIRTUAL(Sensor, estimate);
}

}  // namespace

int main() {
  constants();
  samples();
  measurements();
  descriptor();
  kinematics();
  viwo::record::blocks();
  viwo::record::rig();
  viwo::record::filter_view();
  sensors();
  viwo::record::factors();
  viwo::record::updates();
}
