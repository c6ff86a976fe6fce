// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <fastcdr/Cdr.h>
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <fastrtps/utils/IPLocator.h>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/TopicDataType.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>

#include <cstdlib>
#include <functional>
#include <memory>

// What the programs have in common that speak through Fast DDS, with types written by hand.

namespace fast = eprosima::fastdds::dds;
using eprosima::fastcdr::Cdr;
using eprosima::fastcdr::FastBuffer;
using Payload = eprosima::fastrtps::rtps::SerializedPayload_t;

/// What all types share. XCDR1 as ROS 2 uses it.
class Type : public fast::TopicDataType {
 public:
  Type(const char* name, std::uint32_t size) {
    setName(name);
    m_typeSize = size;
    m_isGetKeyDefined = false;
  }
  std::function<std::uint32_t()> getSerializedSizeProvider(void*) override {
    return [this] { return m_typeSize; };
  }
  bool getKey(void*, eprosima::fastrtps::rtps::InstanceHandle_t*, bool) override { return false; }
};

/// Over UDP on the loopback interface alone, without multicast: others are looked for by their ports. With
/// FASTDDS_AS_IT_COMES in the environment as it comes.
inline fast::DomainParticipantQos local_only(unsigned domain) {
  fast::DomainParticipantQos qos;
  if (std::getenv("FASTDDS_AS_IT_COMES")) return qos;
  auto udp = std::make_shared<eprosima::fastdds::rtps::UDPv4TransportDescriptor>();
  udp->interfaceWhiteList.emplace_back("127.0.0.1");
  qos.transport().use_builtin_transports = false;
  qos.transport().user_transports.push_back(udp);
  for (unsigned index = 0; index < 10; ++index) {
    eprosima::fastrtps::rtps::Locator_t peer;
    peer.kind = LOCATOR_KIND_UDPv4;
    eprosima::fastrtps::rtps::IPLocator::setIPv4(peer, "127.0.0.1");
    peer.port = 7410 + 250 * domain + 2 * index;
    qos.wire_protocol().builtin.initialPeersList.push_back(peer);
  }
  return qos;
}
