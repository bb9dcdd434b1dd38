// Two drives made of node-canopen's devices, for a CAN bus that comes as lines "identifier hex" on standard input.
const readline = require('readline');
const { AccessType, DataType, Device, Eds, ObjectType } = require('canopen');

const STARTS = { 4: 2000, 9: -3000 };
const FAR = 9_999_999; // a target left over from another run
const { INTEGER8: I8, INTEGER16: I16, INTEGER32: I32, UNSIGNED8: U8, UNSIGNED16: U16, UNSIGNED32: U32 } = DataType;
const AFTER = {
    '576,6': 0x0221, '545,7': 0x0223, '547,15': 0x1227, '4647,2': 0x0207, '519,15': 0x1227,
};

function drive(id) {
    const eds = new Eds();
    const variable = (index, dataType, defaultValue) => eds.addEntry(index, {
        parameterName: `object ${index.toString(16)}`, objectType: ObjectType.VAR, dataType, defaultValue,
        accessType: AccessType.READ_WRITE,
    });
    const array = (index, types) => {
        eds.addEntry(index, { parameterName: `object ${index.toString(16)}`, objectType: ObjectType.ARRAY,
            subNumber: 1 });
        types.forEach((dataType, place) => eds.addSubEntry(index, place + 1, {
            parameterName: `part ${place + 1}`, objectType: ObjectType.VAR, dataType, defaultValue: 0,
            accessType: AccessType.READ_WRITE }));
    };
    eds.getEntry(0x1000).raw = Buffer.from([0x92, 0x01, 0x02, 0x00]);
    eds.addSdoServerParameter(0, 0x580 + id, 0x600 + id);
    variable(0x1017, U16, 0);
    array(0x1016, [U32]);
    const word = variable(0x6040, U16, 0), status = variable(0x6041, U16, 0x0240);
    const abort = variable(0x6007, I16, 1), quickStop = variable(0x605A, I16, 2);
    for (const [index, type, value] of [[0x603F, U16, 0], [0x605E, I16, 2],
        [0x6060, I8, 0], [0x6061, I8, 0], [0x606C, I32, 0], [0x6071, I16, 0], [0x6072, U16, 2000],
        [0x6076, U32, 1000], [0x6077, I16, 0], [0x6502, U32, (1 << 7) | (1 << 9)]])
        variable(index, type, value);
    const actual = variable(0x6064, I32, STARTS[id]), target = variable(0x607A, I32, FAR);
    array(0x607D, [I32, I32]);
    array(0x60C2, [U8, I8]);
    const velocity = eds.getEntry(0x606C), error = eds.getEntry(0x603F), torque = eds.getEntry(0x6077);
    eds.addReceivePdo({ cobId: 0x200 + id, transmissionType: 1, dataObjects: [word, target] });
    eds.addTransmitPdo({ cobId: 0x180 + id, transmissionType: 1, dataObjects: [status, torque, actual] });
    eds.addTransmitPdo({ cobId: 0x280 + id, transmissionType: 1, dataObjects: [velocity, error] });
    eds.setSyncCobId(0x80);
    eds.setEmcyCobId(0x80 + id);

    const device = new Device({ id, eds });
    const obey = () => {
        status.value = word.value === 0 ? 0x0240 : AFTER[`${status.value},${word.value}`] ?? status.value;
        if (status.value === 0x1227) actual.value = target.value;
    };
    word.on('update', obey);
    device.pdo.on('pdo', obey);
    device.nmt.on('timeout', (master) => { // their consumer of 0x1016 says so
        if (master !== 127 || status.value !== 0x1227 || abort.value !== 3) return;
        status.value = quickStop.value === 6 ? 0x0207 : 0x0240;
        error.value = 0x8130;
        device.emcy.write(0x8130);
    });
    device.addListener('message', ({ id: cobId, data }) => {
        process.stdout.write(`${cobId.toString(16)} ${Buffer.from(data).toString('hex')}\n`);
    });
    device.start();
    return { device, status, actual };
}

const drives = Object.keys(STARTS).map((id) => drive(Number(id)));
readline.createInterface({ input: process.stdin }).on('line', (line) => {
    const [cobId, hex] = line.split(' ');
    if (cobId === '?')
        return process.stdout.write(`? ${drives.map((one) => `${one.status.value}:${one.actual.value}`).join(' ')}\n`);
    for (const { device } of drives)
        device.receive({ id: parseInt(cobId, 16), data: Buffer.from(hex ?? '', 'hex') });
});
process.stdin.on('end', () => process.exit(0));
process.stdout.write('ready\n');
