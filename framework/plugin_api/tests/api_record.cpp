// Prints what a plugin that was compiled against viwo/api relies on. Compiled without flags for the
// processor, so that it prints the same everywhere (64 bit, Itanium C++ ABI).
#include "api_record.hpp"

#include "viwo/api/plugin.hpp"

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
  RECORD(ImageSample);
  MEMBER(ImageSample, t_ns);
  MEMBER(ImageSample, camera);
  MEMBER(ImageSample, source);
  SAMPLE(ImageSample);
}

void descriptor() {
  ENUM(ParamType);
  RECORD(ParamSpec);
  MEMBER(ParamSpec, name);
  MEMBER(ParamSpec, type);
  MEMBER(ParamSpec, unit);
  MEMBER(ParamSpec, fallback);
  MEMBER(ParamSpec, min);
  MEMBER(ParamSpec, max);
  MEMBER(ParamSpec, min_exclusive);
  MEMBER(ParamSpec, choices);
  MEMBER(ParamSpec, help);
  RECORD(ParamSet);
  std::cout << "  value is " << type_name(typeid(ParamSet::Value)) << "\n";
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
  MEMBER(PluginDescriptor, n_params);
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

void blocks() {
  ENUM(Excitation);
  ENUM(Process);
  RECORD(BlockEntry);
  MEMBER(BlockEntry, name);
  MEMBER(BlockEntry, unit);
  MEMBER(BlockEntry, sigma);
  MEMBER(BlockEntry, process_sigma);
  MEMBER(BlockEntry, needs);
  RECORD(BlockSpec);
  MEMBER(BlockSpec, name);
  MEMBER(BlockSpec, rotations);
  MEMBER(BlockSpec, entries);
  MEMBER(BlockSpec, value);
  MEMBER(BlockSpec, process);
  MEMBER(BlockSpec, time_constant_s);
  MEMBER(BlockSpec, group);
  RECORD(BlockId);
  MEMBER(BlockId, index);
  RECORD(RoomSpec);
  MEMBER(RoomSpec, name);
  MEMBER(RoomSpec, blocks);
  MEMBER(RoomSpec, entries);
  RECORD(RoomId);
  MEMBER(RoomId, index);
  RECORD(BlockView);
}

void rig() {
  ENUM(CameraDistortion);
  RECORD(CameraView);
  MEMBER(CameraView, distortion);
  MEMBER(CameraView, width_px);
  MEMBER(CameraView, height_px);
  MEMBER(CameraView, intrinsics);
  MEMBER(CameraView, R_ItoC);
  MEMBER(CameraView, p_IinC);
  MEMBER(CameraView, t_CtoI_s);
  RECORD(CameraPrior);
  MEMBER(CameraPrior, camera);
  MEMBER(CameraPrior, sigma_extrinsics);
  MEMBER(CameraPrior, sigma_intrinsics);
  MEMBER(CameraPrior, sigma_clock_s);
  MEMBER(CameraPrior, shares_clock);
  RECORD(CameraBlocks);
  MEMBER(CameraBlocks, extrinsics);
  MEMBER(CameraBlocks, intrinsics);
  MEMBER(CameraBlocks, clock);
  MEMBER(CameraBlocks, clock_constant_s);
  RECORD(WheelsView);
  MEMBER(WheelsView, model);
  MEMBER(WheelsView, R_ItoO);
  MEMBER(WheelsView, p_IinO);
  MEMBER(WheelsView, t_OtoI_s);
  MEMBER(WheelsView, x_WI);
  MEMBER(WheelsView, extrinsics_column);
  MEMBER(WheelsView, time_offset_column);
  MEMBER(WheelsView, intrinsics_column);
  MEMBER(WheelsView, wander_column);
  MEMBER(WheelsView, wander_time_s);
  RECORD(WheelsPrior);
  MEMBER(WheelsPrior, name);
  MEMBER(WheelsPrior, sensor);
  MEMBER(WheelsPrior, wheels);
  MEMBER(WheelsPrior, sigma_extrinsics);
  MEMBER(WheelsPrior, sigma_time_offset_s);
  MEMBER(WheelsPrior, sigma_intrinsics);
  MEMBER(WheelsPrior, intrinsics_walk);
  MEMBER(WheelsPrior, sigma_wander);
  MEMBER(WheelsPrior, wander_time_s);
  RECORD(WheelsBlocks);
  MEMBER(WheelsBlocks, model);
  MEMBER(WheelsBlocks, extrinsics);
  MEMBER(WheelsBlocks, clock);
  MEMBER(WheelsBlocks, intrinsics);
  MEMBER(WheelsBlocks, wander);
  MEMBER(WheelsBlocks, wander_time_s);
  RECORD(Rig);
}

void filter_view() {
  RECORD(ImuView);
  MEMBER(ImuView, R_GtoI);
  MEMBER(ImuView, p_IinG);
  MEMBER(ImuView, v_IinG);
  MEMBER(ImuView, gyro_bias);
  MEMBER(ImuView, accel_bias);
  MEMBER(ImuView, R_GtoI_fej);
  MEMBER(ImuView, p_IinG_fej);
  MEMBER(ImuView, v_IinG_fej);
  RECORD(CloneView);
  MEMBER(CloneView, t_ns);
  MEMBER(CloneView, slot);
  MEMBER(CloneView, column);
  MEMBER(CloneView, R_GtoI);
  MEMBER(CloneView, p_IinG);
  MEMBER(CloneView, R_GtoI_fej);
  MEMBER(CloneView, p_IinG_fej);
  MEMBER(CloneView, w_IinI);
  MEMBER(CloneView, v_IinG);
  RECORD(ImuNoise);
  MEMBER(ImuNoise, gyro_rad_per_s_sqrt_hz);
  MEMBER(ImuNoise, accel_m_per_s2_sqrt_hz);
  MEMBER(ImuNoise, gyro_walk_rad_per_s2_sqrt_hz);
  MEMBER(ImuNoise, accel_walk_m_per_s3_sqrt_hz);
  RECORD(FilterView);
  MEMBER(FilterView, imu);
  MEMBER(FilterView, clones);
  MEMBER(FilterView, blocks);
  MEMBER(FilterView, imu_noise);
  MEMBER(FilterView, gravity_m_per_s2);
  MEMBER(FilterView, oldest_leaves);
  MEMBER(FilterView, size);
  MEMBER(FilterView, covariance_data);
  MEMBER(FilterView, covariance_stride);
  RECORD(StreamId);
  MEMBER(StreamId, index);
  RECORD(SampleSpan);
  MEMBER(SampleSpan, type);
  MEMBER(SampleSpan, data);
  MEMBER(SampleSpan, size);
  RECORD(EpochData);
  MEMBER(EpochData, begin_ns);
  MEMBER(EpochData, end_ns);
  MEMBER(EpochData, imu);
  MEMBER(EpochData, streams);
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

void factors() {
  RECORD(ColumnRange);
  MEMBER(ColumnRange, first);
  MEMBER(ColumnRange, count);
  RECORD(FactorColumns);
  RECORD(ResidualFactor);
  MEMBER(ResidualFactor, columns);
  MEMBER(ResidualFactor, H);
  MEMBER(ResidualFactor, residual);
  MEMBER(ResidualFactor, R);
  MEMBER(ResidualFactor, gate_probability);
  MEMBER(ResidualFactor, heavy_tailed);
  MEMBER(ResidualFactor, noise);
  RECORD(InformationFactor);
  MEMBER(InformationFactor, columns);
  MEMBER(InformationFactor, Lambda);
  MEMBER(InformationFactor, eta);
  RECORD(AddedBlock);
  MEMBER(AddedBlock, id);
  MEMBER(AddedBlock, value);
  RECORD(FactorSink::FreeBlocks);
  MEMBER(FactorSink::FreeBlocks, free);
  MEMBER(FactorSink::FreeBlocks, entries);
  MEMBER(FactorSink::FreeBlocks, taken);
  RECORD(FactorSink);
  RECORD(BlockRewrite);
  MEMBER(BlockRewrite, id);
  MEMBER(BlockRewrite, columns);
  MEMBER(BlockRewrite, J);
  MEMBER(BlockRewrite, value);
  MEMBER(BlockRewrite, first_estimate);
  RECORD(BlockEdits);
  SLOTS(BlockEdits);
  VIRTUAL(BlockEdits, drop);
  VIRTUAL(BlockEdits, rewrite);
}

void updates() {
  ENUM(Given);
  RECORD(StreamSpec::Clock);
  MEMBER(StreamSpec::Clock, constant_s);
  MEMBER(StreamSpec::Clock, block);
  RECORD(StreamSpec);
  MEMBER(StreamSpec, type);
  MEMBER(StreamSpec, sensor);
  MEMBER(StreamSpec, given);
  MEMBER(StreamSpec, ends_epochs);
  MEMBER(StreamSpec, awaited);
  MEMBER(StreamSpec, optional);
  MEMBER(StreamSpec, per_instant);
  MEMBER(StreamSpec, clocks);
  RECORD(Declarations);
  SLOTS(Declarations);
  VIRTUAL(Declarations, rig);
  VIRTUAL_OF(Declarations, block, BlockId(Declarations::*)(const BlockSpec&));
  VIRTUAL_OF(Declarations, block, BlockId(Declarations::*)(std::string_view));
  VIRTUAL(Declarations, room);
  VIRTUAL(Declarations, stream);
  RECORD(UpdateSetup);
  MEMBER(UpdateSetup, max_clones);
  MEMBER(UpdateSetup, max_state_size);
  RECORD(Update);
  SLOTS(Update);
  VIRTUAL(Update, declare);
  VIRTUAL(Update, start);
  VIRTUAL(Update, update);
  VIRTUAL(Update, settle);
  VIRTUAL(Update, rejections);
  VIRTUAL(Update, noises);
}

}  // namespace

int main() {
  constants();
  samples();
  measurements();
  descriptor();
  kinematics();
  blocks();
  rig();
  filter_view();
  sensors();
  factors();
  updates();
}
