// The ns-3 side of the comparison in docs/validation.md: saturated lr-wpan senders around one receiver.
// Compiled in memory by tools/ns3_reference.py through the ns3 wheel.
#include "ns3/core-module.h"
#include "ns3/lr-wpan-csmaca.h"
#include "ns3/lr-wpan-mac.h"
#include "ns3/lr-wpan-net-device.h"
#include "ns3/lr-wpan-phy.h"
#include "ns3/mobility-module.h"
#include "ns3/network-module.h"
#include "ns3/propagation-module.h"
#include "ns3/spectrum-module.h"

#include <vector>

namespace reference
{
using namespace ns3;
using namespace ns3::lrwpan;

struct Counts
{
    uint64_t acknowledged = 0;
    uint64_t noAck = 0;
    uint64_t channelBusy = 0;
    uint64_t otherwise = 0;
    uint64_t frames = 0; // begun by senders, retries included
    uint64_t received = 0; // data frames the receiver handed up
    uint32_t psduByte = 0;
};

struct Sender
{
    Ptr<LrWpanNetDevice> device;
    Counts* counts;
    uint32_t payloadByte;
    Time from;

    void Send()
    {
        McpsDataRequestParams request;
        request.m_srcAddrMode = SHORT_ADDR;
        request.m_dstAddrMode = SHORT_ADDR;
        request.m_dstPanId = 0;
        request.m_dstAddr = Mac16Address("00:01");
        request.m_msduHandle = 0;
        request.m_txOptions = TX_OPTION_ACK;
        device->GetMac()->McpsDataRequest(request, Create<Packet>(payloadByte));
    }

    void Confirmed(McpsDataConfirmParams confirm)
    {
        if (Simulator::Now() >= from)
        {
            switch (confirm.m_status)
            {
            case MacStatus::SUCCESS:
                counts->acknowledged++;
                break;
            case MacStatus::NO_ACK:
                counts->noAck++;
                break;
            case MacStatus::CHANNEL_ACCESS_FAILURE:
                counts->channelBusy++;
                break;
            default:
                counts->otherwise++;
            }
        }
        Simulator::ScheduleNow(&Sender::Send, this);
    }

    void Began(Ptr<const Packet> packet)
    {
        counts->psduByte = packet->GetSize();
        if (Simulator::Now() >= from)
        {
            counts->frames++;
        }
    }
};

struct Receiver
{
    Counts* counts;
    Time from;

    void Indicated(McpsDataIndicationParams, Ptr<Packet>)
    {
        if (Simulator::Now() >= from)
        {
            counts->received++;
        }
    }
};

// Positions: the receiver first. Times in seconds; counting begins after `warmUp`.
Counts
saturate(std::vector<double> x,
         std::vector<double> y,
         uint32_t payloadByte,
         double exponent,
         double referenceLossDb,
         double warmUp,
         double duration,
         uint32_t run)
{
    RngSeedManager::SetSeed(1);
    RngSeedManager::SetRun(run);
    RngSeedManager::ResetNextStreamIndex();
    auto channel = CreateObject<SingleModelSpectrumChannel>();
    auto loss = CreateObject<LogDistancePropagationLossModel>();
    loss->SetPathLossExponent(exponent);
    loss->SetReference(1.0, referenceLossDb);
    channel->AddPropagationLossModel(loss);
    channel->SetPropagationDelayModel(CreateObject<ConstantSpeedPropagationDelayModel>());
    Counts counts;
    std::vector<Sender> senders(x.size());
    Receiver receiver{&counts, Seconds(warmUp)};
    std::vector<Ptr<Node>> nodes;
    for (std::size_t i = 0; i < x.size(); ++i)
    {
        auto node = CreateObject<Node>();
        auto device = CreateObject<LrWpanNetDevice>();
        device->SetChannel(channel);
        node->AddDevice(device);
        auto mobility = CreateObject<ConstantPositionMobilityModel>();
        mobility->SetPosition(Vector(x[i], y[i], 0.0));
        node->AggregateObject(mobility);
        device->GetPhy()->SetMobility(mobility);
        uint8_t address[2] = {uint8_t((i + 1) >> 8), uint8_t((i + 1) & 0xff)};
        Mac16Address name;
        name.CopyFrom(address);
        device->SetAddress(name);
        nodes.push_back(node);
        if (i == 0)
        {
            device->GetMac()->SetMcpsDataIndicationCallback(MakeCallback(&Receiver::Indicated, &receiver));
            continue;
        }
        senders[i] = Sender{device, &counts, payloadByte, Seconds(warmUp)};
        device->GetMac()->SetMcpsDataConfirmCallback(MakeCallback(&Sender::Confirmed, &senders[i]));
        device->GetPhy()->TraceConnectWithoutContext("PhyTxBegin", MakeCallback(&Sender::Began, &senders[i]));
        Simulator::Schedule(MicroSeconds(1000 + 37 * i), &Sender::Send, &senders[i]);
    }
    Simulator::Stop(Seconds(warmUp + duration));
    Simulator::Run();
    Simulator::Destroy();
    return counts;
}
} // namespace reference
