// What the updates of a filter have declared: blocks, rooms and streams, those of one name once.
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "viwo/api/update.hpp"

namespace viwo {

/// An update as the estimator runs it.
struct UpdateEntry {
  std::string name;
  std::shared_ptr<Update> update;
  std::shared_ptr<Rig> rig;  ///< what it can ask the configuration for; null for nothing
  std::string sensor;        ///< that gives its samples, where it does not say so itself
};

/// A stream as several updates take it.
struct SharedStream {
  StreamSpec spec;
  std::string takers;  ///< names of the updates, "ranges, standstill"
  bool keeps = false;  ///< somebody wants the samples since the oldest clone
};

class UpdateDeclarations;

class DeclarationTable {
 public:
  DeclarationTable();
  ~DeclarationTable();
  DeclarationTable(DeclarationTable&&) noexcept;
  DeclarationTable& operator=(DeclarationTable&&) noexcept;

  /// Calls declare() of an update. InputError for what it gets wrong, with the names of both for
  /// what contradicts another update.
  void declare(const UpdateEntry& entry);
  /// A stream that somebody else than an update wants.
  StreamId add_stream(const StreamSpec& spec, const std::string& taker) {
    return add_stream(spec, taker, kNobody);
  }
  /// All have declared: InputError for a block that nobody has, a clock that is none, and a group
  /// that cannot be watched.
  void finish() const;

  /// By BlockId::index.
  std::vector<BlockSpec> blocks() const;
  /// By RoomId::index.
  const std::vector<RoomSpec>& rooms() const { return rooms_; }
  /// The update, counted from 0, that has declared a room.
  std::size_t owner_of(std::size_t room) const { return room_owners_[room]; }
  const std::vector<SharedStream>& streams() const { return streams_; }
  static constexpr std::size_t kNobody = static_cast<std::size_t>(-1);
  /// What is taken, by StreamId::index.
  struct Taken {
    std::size_t stream = 0;
    Given given = Given::kOnce;
    std::size_t update = kNobody;  ///< who takes it, counted from 0
  };
  const std::vector<Taken>& taken() const { return taken_; }

 private:
  friend class UpdateDeclarations;
  struct Block {
    BlockSpec spec;
    std::string owner;   ///< who declared it; "" as long as nobody has
    std::string wanted;  ///< who has named it first
  };
  BlockId block(const BlockSpec& spec, const std::string& owner);
  BlockId named(std::string_view name, const std::string& who);
  Block& find_or_add(std::string_view name, const std::string& who);
  void require_new_entries(const BlockSpec& spec, const std::string& owner) const;
  StreamId add_stream(const StreamSpec& spec, const std::string& taker, std::size_t update);
  void require_owners() const;
  void require_clocks() const;
  void require_groups() const;

  std::vector<Block> blocks_;
  std::vector<RoomSpec> rooms_;
  std::vector<std::size_t> room_owners_;
  std::vector<SharedStream> streams_;
  std::vector<Taken> taken_;
  /// One for each update; they live on, for a plugin that has kept the reference.
  std::vector<std::unique_ptr<UpdateDeclarations>> updates_;
};

}  // namespace viwo
