// The part of api_record.cpp that updates rely on: state, factors and declarations.
#pragma once

#include <string_view>

#include "api_record.hpp"
#include "viwo/api/plugin.hpp"

namespace viwo::record {

inline void blocks() {
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

inline void rig() {
  ENUM(CameraDistortion);
  RECORD(CameraView);
  MEMBER(CameraView, distortion);
  MEMBER(CameraView, width_px);
  MEMBER(CameraView, height_px);
  MEMBER(CameraView, intrinsics);
  MEMBER(CameraView, R_ItoC);
  MEMBER(CameraView, p_IinC);
  MEMBER(CameraView, t_CtoI_s);
  MEMBER(CameraView, line_delay_s);
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
  MEMBER(CameraBlocks, middle_constant_s);
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

inline void filter_view() {
  RECORD(ImuState);
  MEMBER(ImuState, R_GtoI);
  MEMBER(ImuState, p_IinG);
  MEMBER(ImuState, v_IinG);
  MEMBER(ImuState, gyro_bias);
  MEMBER(ImuState, accel_bias);
  MEMBER(ImuState, R_GtoI_fej);
  MEMBER(ImuState, p_IinG_fej);
  MEMBER(ImuState, v_IinG_fej);
  RECORD(CloneState);
  MEMBER(CloneState, t_ns);
  MEMBER(CloneState, slot);
  MEMBER(CloneState, column);
  MEMBER(CloneState, R_GtoI);
  MEMBER(CloneState, p_IinG);
  MEMBER(CloneState, R_GtoI_fej);
  MEMBER(CloneState, p_IinG_fej);
  MEMBER(CloneState, w_IinI);
  MEMBER(CloneState, v_IinG);
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

inline void factors() {
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

inline void updates() {
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

}  // namespace viwo::record
