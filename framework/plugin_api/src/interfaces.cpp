// Key functions of the interfaces: one vtable and one typeinfo for the whole process, here.
#include "viwo/api/kinematic_model.hpp"
#include "viwo/api/sensor.hpp"
#include "viwo/api/status.hpp"
#include "viwo/api/update.hpp"

namespace viwo {

InputError::InputError(const std::string& text) : std::runtime_error(text) {}
InputError::~InputError() = default;

ParamError::ParamError(std::string key, const std::string& text)
    : InputError(text), key_(std::move(key)) {}
ParamError::~ParamError() = default;

ContractError::ContractError(const std::string& text) : std::logic_error(text) {}
ContractError::~ContractError() = default;

KinematicModel::~KinematicModel() = default;

Status KinematicModel::inverse(const Twist& /*xi*/, const Intrinsics& /*x_WI*/,
                               const RowVector& /*slip*/, EncoderSample& /*y*/) const {
  return Status::kUnsupported;
}

Status KinematicModel::move_frame(const Eigen::Vector3d& /*g*/, Intrinsics& /*x_WI*/) const {
  return Status::kUnsupported;
}

Sensor::~Sensor() = default;

bool Sensor::can_be_exact() const { return false; }

void Sensor::rejections(std::vector<RejectionCount>& /*out*/) const {}

bool Sensor::takes_input() const { return false; }

void Sensor::connect(Sensor& /*input*/) {}

bool Sensor::live() const { return false; }

void Sensor::stop() {}

void Sensor::estimate(const EstimateSample& /*estimate*/) {}

ImageSource::~ImageSource() = default;

void ImageSource::read_of_size(int width_px, int height_px, Image& out) const {
  read(out);
  if (out.width_px != width_px || out.height_px != height_px) out.pixels.clear();
}

Declarations::~Declarations() = default;

BlockEdits::~BlockEdits() = default;

Update::~Update() = default;

void Update::start(const UpdateSetup& /*setup*/) {}

void Update::settle(const FilterView& /*filter*/, BlockEdits& /*edits*/) {}

void Update::rejections(std::vector<RejectionCount>& /*out*/) const {}

void Update::noises(std::vector<NoiseFound>& /*out*/) const {}

}  // namespace viwo
