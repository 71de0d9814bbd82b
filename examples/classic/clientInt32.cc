// SPDX-License-Identifier: MIT
// clientInt32: sends Int32 messages to a server and checks the replies, written for the original
// MPF.
//
// The manual names this file ("Message Server", "Example") and prints no source of it. The class
// follows the four steps of "Message Client". The lines below "for Linux" complete it: on vxWorks,
// the startup file calls clientInt32().
#include <vxWorks.h>
#include <stdio.h>
#include <stdlib.h>
#include <semLib.h>

#include "Message.h"
#include "ConnectMessage.h"
#include "Int32Message.h"
#include "mpfType.h"

class ClientInt32 {
public:
    ClientInt32(int number);
    static void callback(Message *message,void *pvt);
    void receive(Message *message);
    MessageClient *pMessageClient;
    SEM_ID connected;
    SEM_ID done;
    int number;
    int received;
    int failed;
};

ClientInt32::ClientInt32(int number)
: number(number), received(0), failed(0)
{
    connected = semBCreate(SEM_Q_FIFO,SEM_EMPTY);
    done = semBCreate(SEM_Q_FIFO,SEM_EMPTY);
    pMessageClient = new MessageClient(callback,(void *)this);
}

void ClientInt32::callback(Message *message,void *pvt)
{
    ((ClientInt32 *)pvt)->receive(message);
}

void ClientInt32::receive(Message *message)
{
    if(message->getType()==messageTypeConnect) {
        ConnectMessage *pconnect = (ConnectMessage *)message;
        if(pconnect->status==connectYes) semGive(connected);
        delete message;
        return;
    }
    if(message->getType()!=messageTypeInt32) {
        printf("clientInt32 got illegal message type %d\n",message->getType());
        failed++;
    } else {
        Int32Message *preply = (Int32Message *)message;
        if(preply->status!=0) failed++;
        printf("reply %d status %d\n",preply->value,preply->status);
    }
    delete message;
    if(++received==number) semGive(done);
}

extern "C" int clientInt32(char *server,int location,int number)
{
    ClientInt32 *pClientInt32 = new ClientInt32(number);
    if(pClientInt32->pMessageClient->bind(server,location)) return(ERROR);
    semTake(pClientInt32->connected,WAIT_FOREVER);
    for(int i=1; i<=number; i++) {
        Int32Message *pmessage = new Int32Message;
        pmessage->value = i;
        if(pClientInt32->pMessageClient->send(pmessage)) {
            printf("clientInt32 send failed\n");
            return(ERROR);
        }
    }
    semTake(pClientInt32->done,WAIT_FOREVER);
    delete pClientInt32->pMessageClient;
    return(pClientInt32->failed);
}

// ---- for Linux
int main(int argc, char **argv)
{
    if(argc < 3) {
        printf("usage: clientInt32 SERVER NUMBER\n");
        return 2;
    }
    return clientInt32(argv[1],0,atoi(argv[2])) == 0 ? 0 : 1;
}
